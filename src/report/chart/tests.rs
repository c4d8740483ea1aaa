use super::scale::Scale;
use super::*;

fn chart(log: bool, points: &[(f64, f64)]) -> Chart {
    let axis = if log { Axis::log } else { Axis::linear };
    Chart {
        title: "Time <of> work & \"rest\"".to_owned(),
        x: axis("size", "rays"),
        y: axis("time", "s"),
        series: vec![Series::new("a, b", Style::Line, points.iter().copied())],
        note: "two cores".to_owned(),
    }
}

/// Numbers on an axis.
fn labels(log: bool, values: &[f64]) -> Vec<String> {
    let axis = Axis { log, ..Axis::default() };
    let ticks = Scale::of(&axis, values.iter().copied()).ticks(7);
    assert!(ticks.iter().all(|tick| (0.0..=1.0).contains(&tick.at)), "{ticks:?}");
    ticks.into_iter().map(|tick| tick.label).filter(|label| !label.is_empty()).collect()
}

#[test]
fn ticks_are_round_numbers() {
    assert_eq!(labels(false, &[0.0, 10.0]), ["0", "2", "4", "6", "8", "10"]);
    assert_eq!(labels(false, &[1e6, 9e6]), ["0", "2×10⁶", "4×10⁶", "6×10⁶", "8×10⁶"]);
    assert_eq!(labels(false, &[1.8876e11, 1.8884e11])[0], "1.8876×10¹¹");
    assert_eq!(labels(false, &[1_234_500.0, 1_234_600.0])[1], "1234520");
    assert_eq!(labels(false, &[0.9, 0.96]), ["0.90", "0.91", "0.92", "0.93", "0.94", "0.95", "0.96"]);
    assert_eq!(labels(false, &[-1.0, 1.0]), ["-1.0", "-0.5", "0", "0.5", "1.0"]);
    assert_eq!(labels(true, &[1.0, 1000.0]), ["1", "10", "100", "1000"]);
    assert_eq!(labels(true, &[1e-6, 1e6]), ["10⁻⁶", "10⁻⁴", "0.01", "1", "100", "10000", "10⁶"]);
    assert_eq!(labels(true, &[1.0, 20.0]), ["1", "2", "5", "10", "20"]);
    assert_eq!(labels(true, &[4.1, 4.4]), ["4.1", "4.2", "4.3", "4.4"]);
}

#[test]
fn zero_has_a_place_of_its_own_on_a_logarithmic_axis() {
    assert_eq!(labels(true, &[0.0, 1.0, 100.0]), ["1", "10", "100", "0"]);
    let scale = Scale::of(&Axis::log("", ""), [0.0, 1.0, 100.0].into_iter());
    assert!(scale.at(0.0) < scale.at(1.0) && scale.at(1.0) < scale.at(100.0));
    assert_eq!(labels(true, &[0.0]).last().map(String::as_str), Some("0"));
}

#[test]
fn no_one_many_and_equal_values_are_drawn() {
    let many: Vec<(f64, f64)> = (1..1000).map(|i| (f64::from(i), f64::from(i * i))).collect();
    let sets: [&[(f64, f64)]; 7] = [
        &[],
        &[(3.0, 5.0)],
        &[(3.0, 5.0), (3.0, 5.0)],
        &[(0.0, 0.0)],
        &[(1e-300, 1e300)],
        &[(1.0, 2.0), (1e9, 2.0)],
        &many,
    ];
    for (points, log) in sets.into_iter().flat_map(|set| [(set, false), (set, true)]) {
        for style in [Style::Line, Style::Points, Style::Front] {
            let mut chart = chart(log, points);
            chart.series[0].style = style;
            let svg = chart.svg().unwrap();
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{points:?}");
            assert_eq!(svg.contains("no data"), points.is_empty());
        }
    }
    assert!(svg(&[], 3).unwrap().starts_with("<svg"));
}

#[test]
fn numbers_without_a_place_are_refused() {
    let refused = |chart: Chart| {
        let error = chart.svg().unwrap_err();
        assert!(error.to_string().contains("series 'a, b'"), "{error}");
        assert!(csv(&[chart]).is_err());
    };
    refused(chart(false, &[(f64::NAN, 1.0)]));
    refused(chart(false, &[(1.0, f64::INFINITY)]));
    refused(chart(true, &[(-1.0, 1.0)]));
    refused(chart(true, &[(1.0, -1.0)]));
    for interval in [[2.0, 1.0], [f64::NAN, 1.0], [0.0, f64::NAN]] {
        let mut chart = chart(false, &[]);
        chart.series[0].points.push(Point { x: 1.0, y: 1.0, interval: Some(interval) });
        refused(chart);
    }
}

#[test]
fn names_are_escaped_in_svg_and_quoted_in_csv() {
    let svg = chart(false, &[(1.0, 2.0)]).svg().unwrap();
    assert!(svg.contains("Time &lt;of&gt; work &amp; &quot;rest&quot;") && !svg.contains("<of>"));
    let mut chart = chart(false, &[(1.0, 2.0)]);
    chart.series[0].points.push(Point { x: 2.5, y: 3.0, interval: Some([2.0, 4.0]) });
    let expected = "chart,series,x axis,x,y axis,y,low,high\n\
                    \"Time <of> work & \"\"rest\"\"\",\"a, b\",size (rays),1,time (s),2,,\n\
                    \"Time <of> work & \"\"rest\"\"\",\"a, b\",size (rays),2.5,time (s),3,2,4\n";
    assert_eq!(csv(&[chart]).unwrap(), expected);
}

/// Text is there in pixels too: dark pixels remain in the rows of the title, where nothing else is drawn.
#[test]
fn pictures_show_text() {
    let png = png(&[chart(true, &[(1.0, 2.0), (100.0, 5.0)])], 1).unwrap();
    let picture = image::load_from_memory(&png).unwrap().to_luma8();
    let dark = picture.enumerate_pixels().filter(|(_, y, pixel)| *y < 60 && pixel.0[0] < 100).count();
    assert!(dark > 500, "{dark} dark pixels");
}

#[test]
fn legends_and_notes_take_the_lines_they_need() {
    let mut few = chart(false, &[(1.0, 1.0)]);
    let height = |chart: &Chart| {
        let svg = chart.svg().unwrap();
        svg.split("height=\"").nth(1).unwrap().split('"').next().unwrap().parse::<i32>().unwrap()
    };
    let before = height(&few);
    few.series = (0..12).map(|i| Series::new(format!("a longer name {i}"), Style::Line, [])).collect();
    few.note = "words ".repeat(60);
    assert!(height(&few) > before + 80);
}
