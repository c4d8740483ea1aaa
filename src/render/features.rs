//! What a scene needs of the kernels; the rest is compiled out.

use crate::scene::Scene;
use crate::shared::*;

/// What a diffuse surface asks of its surroundings besides lights.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Indirect {
    /// Nothing.
    None,
    /// One ambient occlusion ray.
    Ao,
    /// One diffuse bounce.
    Diffuse,
}

/// Parts of the shading kernels, each a specialization constant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Features {
    /// Corner normals.
    pub normals: bool,
    /// Base-colour textures.
    pub textures: bool,
    /// Metals.
    pub mirrors: bool,
    /// Transmission.
    pub glass: bool,
    /// Emissive surfaces.
    pub emission: bool,
    /// Unlit surfaces.
    pub unlit: bool,
    /// Indirect light.
    pub indirect: Indirect,
}

impl Features {
    /// What `scene` needs. Without an `indirect` of the user's choice, scenes with light of their own get a
    /// diffuse bounce; others would be dark inside, and get ambient occlusion.
    pub fn of(scene: &Scene, indirect: Option<Indirect>) -> Features {
        let any = |has: fn(&crate::scene::Material) -> bool| scene.materials.iter().any(has);
        let emission = any(|m| m.emissive.iter().any(|&c| c > 0.0));
        let lit = emission || !scene.lights.is_empty();
        Features {
            normals: !scene.normals.is_empty(),
            textures: !scene.uvs.is_empty(),
            mirrors: any(|m| m.metallic > 0.0),
            glass: any(|m| m.transmission > 0.0),
            emission,
            unlit: any(|m| m.unlit),
            indirect: indirect.unwrap_or(if lit { Indirect::Diffuse } else { Indirect::Ao }),
        }
    }

    /// The constant that the kernels know `indirect` by.
    pub fn indirect_code(&self) -> u32 {
        match self.indirect {
            Indirect::None => INDIRECT_NONE,
            Indirect::Ao => INDIRECT_AO,
            Indirect::Diffuse => INDIRECT_DIFFUSE,
        }
    }

    /// Whether a path can go on after its first hit.
    pub fn bounces(&self) -> bool {
        self.mirrors || self.glass || self.indirect == Indirect::Diffuse
    }

    /// Names of the parts that are compiled in, and of those that are compiled out.
    pub fn names(&self) -> (Vec<&'static str>, Vec<&'static str>) {
        let all = [
            ("normals", self.normals),
            ("textures", self.textures),
            ("mirrors", self.mirrors),
            ("glass", self.glass),
            ("emission", self.emission),
            ("unlit", self.unlit),
            ("ambient occlusion", self.indirect == Indirect::Ao),
            ("diffuse bounce", self.indirect == Indirect::Diffuse),
        ];
        let pick = |wanted| all.iter().filter(|(_, on)| *on == wanted).map(|(name, _)| *name).collect();
        (pick(true), pick(false))
    }

    /// As specialization constants.
    pub fn specialization(&self) -> [(u32, u32); 7] {
        [
            (SPEC_NORMALS, self.normals.into()),
            (SPEC_TEXTURES, self.textures.into()),
            (SPEC_MIRRORS, self.mirrors.into()),
            (SPEC_GLASS, self.glass.into()),
            (SPEC_EMISSION, self.emission.into()),
            (SPEC_UNLIT, self.unlit.into()),
            (SPEC_INDIRECT, self.indirect_code()),
        ]
    }
}
