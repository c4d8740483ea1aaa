//! `caribou verify`: does this device give the twin's bits?

use std::fmt::Write;

use clap::Args;

use super::input::{DeviceArguments, Prepared, SceneArguments};
use super::output;
use crate::render::features::Features;
use crate::render::picture::{Request, picture};
use crate::render::settings::Settings;
use crate::report::verify::{verify_rays, verify_virtual_l1s};
use crate::scene::select_camera;
use crate::trace::TracerOptions;
use crate::trace::verify::{Verdict, verify_arithmetic};
use crate::vulkan::Gpu;
use crate::{Error, Result};

/// Check that a device's rays, hits and pictures equal the CPU twin's, bit for bit
#[derive(Args)]
pub struct Verify {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    device: DeviceArguments,
    /// Pixels across
    #[arg(long, default_value_t = 256)]
    width: u32,
    /// Pixels down
    #[arg(long, default_value_t = 192)]
    height: u32,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl Verify {
    /// Compares, prints, and fails on any difference.
    pub fn run(&self) -> Result<()> {
        let settings = self.settings(1.0);
        settings.check()?;
        let gpu =
            self.device.open()?.ok_or_else(|| Error::usage("--twin", "there is nothing to compare the twin with"))?;
        let prepared = self.scene.prepare(self.json)?;
        let verdicts = self.compare(&gpu, &prepared)?;
        match self.json {
            true => output::print_json(&verdicts)?,
            false => output::print(&table(&gpu, &verdicts))?,
        }
        let failed: Vec<&str> = verdicts.iter().filter(|v| v.mismatches > 0).map(|v| v.what.as_str()).collect();
        if !failed.is_empty() {
            return Err(Error::Check(format!("{} differ from the twin's on {}", failed.join(", "), gpu.info().name)));
        }
        match gpu.validation_messages().first() {
            Some(message) => Err(Error::Check(format!("validation: {message}"))),
            None => Ok(()),
        }
    }

    fn settings(&self, ao_radius: f32) -> Settings {
        let (width, height) = (self.width, self.height);
        Settings { width, height, spp: 2, ao_radius, ..Settings::default() }
    }

    fn compare(&self, gpu: &Gpu, prepared: &Prepared) -> Result<Vec<Verdict>> {
        let camera = select_camera(&prepared.scene, self.scene.camera.as_deref())?;
        let settings = self.settings(Settings::default_ao_radius(prepared.bvh.bounds));
        let (bvh, tables) = (&prepared.bvh, &prepared.tables);
        let mut verdicts = verify_arithmetic(gpu)?;
        verdicts.extend(verify_rays(gpu, bvh, tables, settings.frame(&camera))?);
        verdicts.extend(verify_virtual_l1s(gpu, bvh, tables, settings.frame(&camera))?);
        let features = Features::of(&prepared.scene, None);
        let request = |tracing| Request { bvh, tables, camera: &camera, settings, features, aovs: true, tracing };
        for options in TracerOptions::all() {
            let [device, twin] = [Some(gpu), None].map(|gpu| picture(gpu, &request(options), &mut |_| {}));
            let (device, twin) = (device?, twin?);
            verdicts.push(Verdict {
                what: format!("{} pictures", options.name()),
                cases: u64::from(self.width) * u64::from(self.height),
                mismatches: device.film.differing_pixels(&twin.film),
                digest: None,
            });
        }
        Ok(verdicts)
    }
}

fn table(gpu: &Gpu, verdicts: &[Verdict]) -> String {
    let mut text =
        format!("{} against the CPU twin\n{:<36} {:>10} {:>10}\n", gpu.info().name, "", "compared", "differ");
    for v in verdicts {
        let digest = v.digest.as_deref().unwrap_or_default();
        let _ = writeln!(text, "{:<36} {:>10} {:>10}  {digest}", v.what, v.cases, v.mismatches);
    }
    text
}
