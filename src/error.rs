//! What a constructor refuses.

use std::fmt;

/// Why a constructor refused its input; each variant names the field.
///
/// ```
/// use truehit::{InvalidShape, Sphere};
/// let error = Sphere::new([0.0; 3], -1.0).unwrap_err();
/// assert_eq!(error, InvalidShape::NotPositive { field: "radius", value: -1.0 });
/// assert_eq!(error.to_string(), "radius must be above zero, got -1");
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum InvalidShape {
    /// A NaN or an infinity.
    NotFinite {
        /// The argument.
        field: &'static str,
    },
    /// A length that must be above zero is not.
    NotPositive {
        /// The argument.
        field: &'static str,
        /// What was given.
        value: f64,
    },
    /// A length that must not be below zero is.
    Negative {
        /// The argument.
        field: &'static str,
        /// What was given.
        value: f64,
    },
    /// A vector that gives a direction is zero.
    ZeroVector {
        /// The argument.
        field: &'static str,
    },
    /// Points that must differ (or not lie on one line) do not.
    Degenerate {
        /// The argument or arguments.
        field: &'static str,
    },
    /// Fewer elements than the shape needs.
    TooFew {
        /// The argument.
        field: &'static str,
        /// The least that will do.
        needed: usize,
        /// What was given.
        given: usize,
    },
    /// More elements than an index can number.
    TooMany {
        /// The argument.
        field: &'static str,
        /// What was given.
        given: usize,
    },
    /// A polygon's vertex is off the plane of the others by more than rounding explains.
    NotPlanar {
        /// The contour: 0 is the outer one.
        contour: usize,
        /// The vertex in that contour.
        vertex: usize,
        /// Its distance from the plane.
        distance: f64,
        /// The distance that rounding explains.
        allowed: f64,
    },
    /// An index names no element.
    IndexOutOfRange {
        /// The argument.
        field: &'static str,
        /// Where in the argument.
        at: usize,
        /// The index found there.
        index: u32,
        /// How many elements there are.
        count: usize,
    },
    /// Two arguments must have the same length.
    LengthMismatch {
        /// The argument.
        field: &'static str,
        /// The length it must have.
        needed: usize,
        /// The length it has.
        given: usize,
    },
    /// An affine map that flattens space, or that cannot be inverted in f64.
    Singular {
        /// The argument.
        field: &'static str,
    },
    /// The observer of a long build ended it.
    Cancelled,
    /// A number so large or so small that the answers could not be represented.
    OutOfRange {
        /// The argument.
        field: &'static str,
        /// What was given.
        value: f64,
    },
}

impl fmt::Display for InvalidShape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NotFinite { field } => write!(f, "{field} must be finite"),
            Self::NotPositive { field, value } => write!(f, "{field} must be above zero, got {value}"),
            Self::Negative { field, value } => write!(f, "{field} must not be negative, got {value}"),
            Self::ZeroVector { field } => write!(f, "{field} must not be the zero vector"),
            Self::Degenerate { field } => write!(f, "{field} must not coincide or lie on one line"),
            Self::TooFew { field, needed, given } => {
                write!(f, "{field} needs at least {needed} elements, got {given}")
            }
            Self::TooMany { field, given } => write!(f, "{field} has too many elements: {given}"),
            Self::NotPlanar { contour, vertex, distance, allowed } => write!(
                f,
                "vertex {vertex} of contour {contour} is {distance:e} off the polygon's plane (rounding explains {allowed:e})"
            ),
            Self::IndexOutOfRange { field, at, index, count } => {
                write!(f, "{field}[{at}] is {index}, but there are only {count} elements")
            }
            Self::LengthMismatch { field, needed, given } => {
                write!(f, "{field} needs {needed} elements, got {given}")
            }
            Self::Singular { field } => write!(f, "{field} must be an invertible map"),
            Self::Cancelled => f.write_str("the build was cancelled by its observer"),
            Self::OutOfRange { field, value } => write!(f, "{field} is out of range: {value:e}"),
        }
    }
}

impl std::error::Error for InvalidShape {}
