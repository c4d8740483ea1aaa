//! A self-contained web page: headings, paragraphs, tables and figures in one file that loads nothing.

use std::fmt::Write;

/// A part of a page. Text is escaped.
#[derive(Clone, Debug)]
pub enum Section {
    /// A heading.
    Heading(String),
    /// A paragraph.
    Paragraph(String),
    /// Names of columns, and rows.
    Table(Vec<String>, Vec<Vec<String>>),
    /// A picture that [`super::chart`] made.
    Figure(String),
}

const STYLE: &str = "body{font:15px/1.5 sans-serif;max-width:1260px;margin:2em auto;padding:0 1em;color:#222}\
    table{border-collapse:collapse;margin:1em 0;font-size:13px}\
    th,td{border:1px solid #ccc;padding:.3em .6em;text-align:left;vertical-align:top}th{background:#f2f2f2}\
    figure{margin:1em 0}svg{max-width:100%;height:auto}";

/// The page.
pub fn page(title: &str, sections: &[Section]) -> String {
    let title = escaped(title);
    let mut html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>\
         <style>{STYLE}</style></head>\n<body><h1>{title}</h1>\n"
    );
    for section in sections {
        // Writing to a string cannot fail.
        let _ = match section {
            Section::Heading(text) => writeln!(html, "<h2>{}</h2>", escaped(text)),
            Section::Paragraph(text) => writeln!(html, "<p>{}</p>", escaped(text)),
            Section::Table(head, rows) => {
                let body: String = rows.iter().map(|cells| row("td", cells)).collect();
                writeln!(html, "<table>{}{body}</table>", row("th", head))
            }
            Section::Figure(svg) => writeln!(html, "<figure>{svg}</figure>"),
        };
    }
    html + "</body></html>\n"
}

fn row(tag: &str, cells: &[String]) -> String {
    let cells: String = cells.iter().map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell))).collect();
    format!("<tr>{cells}</tr>\n")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_text_is_escaped_and_nothing_is_loaded() {
        let bad = "<script>\"&".to_owned();
        let sections = [
            Section::Heading(bad.clone()),
            Section::Paragraph(bad.clone()),
            Section::Table(vec![bad.clone()], vec![vec![bad.clone()]]),
            Section::Figure("<svg></svg>".to_owned()),
        ];
        let html = page(&bad, &sections);
        assert_eq!(html.matches("&lt;script&gt;&quot;&amp;").count(), 6);
        assert!(!html.contains("<script>") && !html.contains("href") && !html.contains("src="));
        assert_eq!(html.matches("<svg></svg>").count(), 1);
    }
}
