//! Where light comes from.

use super::Rgb;
use crate::kernel::float::unit;
use crate::{Interval, Ray, Surface};
use glam::DVec3;

/// A light without extent. It does not fade with distance: the lecture's I_d and I_s are constants.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Light {
    /// Shines from one point in all directions.
    Point {
        /// Where.
        position: DVec3,
        /// I_d = I_s.
        intensity: Rgb,
    },
    /// Shines from infinitely far away: a sun.
    Directional {
        /// From any surface towards the light; any non-zero length.
        towards: DVec3,
        /// I_d = I_s.
        intensity: Rgb,
    },
}

/// What a light sends to a point on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incident {
    /// s: the unit vector from the point towards the light. NaN for a point light on the very point, and for a
    /// direction of zero: neither lights anything.
    pub direction: DVec3,
    /// I_d = I_s.
    pub intensity: Rgb,
}

impl Light {
    /// A point light.
    pub fn point(position: impl Into<DVec3>, intensity: impl Into<DVec3>) -> Self {
        Self::Point { position: position.into(), intensity: intensity.into() }
    }

    /// A sun: `towards` is the way *to* it.
    pub fn directional(towards: impl Into<DVec3>, intensity: impl Into<DVec3>) -> Self {
        Self::Directional { towards: towards.into(), intensity: intensity.into() }
    }

    /// The light that reaches `point` if nothing is in the way.
    #[must_use]
    pub fn incident(&self, point: DVec3) -> Incident {
        match *self {
            Self::Point { position, intensity } => {
                Incident { direction: unit(position - point).unwrap_or(DVec3::NAN), intensity }
            }
            Self::Directional { towards, intensity } => {
                Incident { direction: unit(towards).unwrap_or(DVec3::NAN), intensity }
            }
        }
    }

    /// The shadow ray from `surface`, and the stretch of it on which an object casts a shadow: see
    /// [`Scene::occludes`](crate::Scene::occludes).
    #[must_use]
    pub fn shadow_ray(&self, surface: &Surface<'_>) -> (Ray, Interval) {
        match *self {
            Self::Point { position, .. } => (surface.spawn_to(position), Interval::new(0.0, 1.0)),
            Self::Directional { towards, .. } => (surface.spawn(towards), Interval::FORWARD),
        }
    }
}
