//! Arbitrary output variables: what a picture can hold beside its colour, and the channel names.

use std::str::FromStr;

use crate::{Error, Result};

/// What the ray of a pixel's first sample met, and, last, what the pixel cost. Where it met nothing all are 0, except for `Z`, which is
/// [`Z_NOTHING`](crate::shared::Z_NOTHING), `primId`, which is [`NO_HIT`](crate::shared::NO_HIT), and the counts from `steps` on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Aov {
    /// Depth along the camera's viewing axis in world units.
    Z,
    /// World-space unit shading normal.
    N,
    /// Linear base colour.
    Albedo,
    /// World-space position.
    P,
    /// Primitive id, the only integer.
    PrimId,
    /// BVH nodes visited by the primary ray.
    Steps,
    /// Times that it went to another SM, with strategy `migrate`.
    Migrations,
    /// Subtrees that it entered, with strategy `migrate`.
    Subtrees,
    /// Samples of the pixel.
    Samples,
}

impl Aov {
    /// All, in the order of `--aov all`.
    pub const ALL: [Aov; 9] =
        [Aov::Z, Aov::N, Aov::Albedo, Aov::P, Aov::PrimId, Aov::Steps, Aov::Migrations, Aov::Subtrees, Aov::Samples];

    /// The name on the command line, which is also the layer's name in the file.
    pub fn name(self) -> &'static str {
        match self {
            Aov::Z => "Z",
            Aov::N => "N",
            Aov::Albedo => "albedo",
            Aov::P => "P",
            Aov::PrimId => "primId",
            Aov::Steps => "steps",
            Aov::Migrations => "migrations",
            Aov::Subtrees => "subtrees",
            Aov::Samples => "samples",
        }
    }

    /// OpenEXR channel names, in the order of the components.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Aov::Z => &["Z"],
            Aov::N => &["N.X", "N.Y", "N.Z"],
            Aov::Albedo => &["albedo.R", "albedo.G", "albedo.B"],
            Aov::P => &["P.X", "P.Y", "P.Z"],
            Aov::PrimId => &["primId"],
            Aov::Steps => &["steps"],
            Aov::Migrations => &["migrations"],
            Aov::Subtrees => &["subtrees"],
            Aov::Samples => &["samples"],
        }
    }

    /// Number of components: 1 or 3.
    pub fn components(self) -> usize {
        self.channels().len()
    }

    /// Reads a comma-separated list such as `Z,N,albedo` or `all`. Upper and lower case are the same;
    /// the result is in the order of [`Aov::ALL`] with repetitions dropped.
    ///
    /// # Errors
    /// [`Error::Usage`] that lists the known names, for an unknown or empty one.
    pub fn parse_list(list: &str) -> Result<Vec<Aov>> {
        if list.trim().eq_ignore_ascii_case("all") {
            return Ok(Aov::ALL.to_vec());
        }
        let mut aovs = list.split(',').map(|name| name.trim().parse()).collect::<Result<Vec<Aov>>>()?;
        aovs.sort_unstable();
        aovs.dedup();
        Ok(aovs)
    }
}

impl FromStr for Aov {
    type Err = Error;

    fn from_str(name: &str) -> Result<Aov> {
        let found = Aov::ALL.into_iter().find(|aov| aov.name().eq_ignore_ascii_case(name));
        found.ok_or_else(|| {
            let known = Aov::ALL.map(Aov::name).join(", ");
            Error::usage(format!("unknown AOV '{name}'"), format!("known are {known} and all"))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_parses_in_any_case() {
        for aov in Aov::ALL {
            assert_eq!(Aov::parse_list(aov.name()).unwrap(), [aov]);
            assert_eq!(Aov::parse_list(&aov.name().to_uppercase()).unwrap(), [aov]);
            assert_eq!(aov.components(), aov.channels().len());
        }
        assert_eq!(Aov::parse_list("Z,N,albedo,P,primId,steps,migrations,subtrees,samples").unwrap(), Aov::ALL);
        assert_eq!(Aov::parse_list("ALL").unwrap(), Aov::ALL);
    }

    #[test]
    fn a_list_is_ordered_and_has_no_repetitions() {
        assert_eq!(Aov::parse_list(" steps , z,STEPS").unwrap(), [Aov::Z, Aov::Steps]);
    }

    #[test]
    fn an_unknown_name_is_refused_with_the_known_ones() {
        for bad in ["depth", "", "Z,", "Z;N", "Z,all"] {
            let error = Aov::parse_list(bad).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(
                error.to_string().contains("Z, N, albedo, P, primId, steps, migrations, subtrees, samples"),
                "{error}"
            );
        }
    }
}
