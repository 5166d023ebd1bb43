//! The unit roundoff and what is built from it: every constant of every filter stands here, with its derivation.

/// The unit roundoff of f64, 2⁻⁵³: a rounded operation is off by at most `U` times its result.
pub const U: f64 = f64::EPSILON / 2.0;

/// γₙ = n·u/(1 − n·u): a bound on the relative error of n roundings in a row (Higham, *Accuracy and Stability*, §3.1).
#[must_use]
pub const fn gamma(n: u32) -> f64 {
    let nu = n as f64 * U;
    nu / (1.0 - nu)
}

/// Covers the rounding of a bound's own arithmetic: at most 64 operations on positive numbers, each up by 1 + u.
pub const INFLATE: f64 = 1.0 + 128.0 * U;

/// What underflow can add to a sum of a few dozen products: each is off by at most 2⁻¹⁰⁷⁴, and so is each of their
/// rounding errors. Far below any number the filters decide on, it keeps them honest where products vanish.
pub const UNDERFLOW: f64 = f64::from_bits((1023 - 1000) << 52); // 2⁻¹⁰⁰⁰

/// Triangle, docs/numerics.md §4: each edge function is off by at most 49u·|d|∞·(|e₁||e₂| + |s|(|e₁|+|e₂|)), in largest
/// components; the last one covers the bound's own arithmetic.
pub const TRIANGLE_SIDES: f64 = 50.0 * U;

/// Triangle, docs/numerics.md §4: the fast path takes a ray if |e₁||e₂||d| and |e₁||e₂||s|, in largest components, are
/// below this times |D| and |N|.
pub const TRIANGLE_CONDITION: f64 = (1 << 18) as f64;

/// Triangle, docs/numerics.md §4: then λ, beyond its last rounding, is off by less than this times |λ|.
pub const TRIANGLE_LAMBDA: f64 = U / 16.0;

/// Triangle, docs/numerics.md §4: in double-double each edge function is off by this times |d|·(|e₁||e₂| +
/// |s|(|e₁|+|e₂|)), and λ, beyond its last rounding, by this times (|e₁||e₂|/|D|)·(|s| + |λ||d|).
pub const TRIANGLE_CLOSE: f64 = 600.0 * U * U;

/// A triangle's edges, and differences and directions in triple products, stay below this, together: nothing overflows,
/// and underflow takes less than [`VANISHED`].
pub const LARGEST: f64 = f64::from_bits((1023 + 250) << 52);

/// Triple products of numbers below [`LARGEST`] lose less than 2⁻⁸²⁰ by underflow: nothing if they are above this.
pub const VANISHED: f64 = f64::from_bits((1023 - 640) << 52);

/// Triangle, docs/numerics.md §4: the normal is off by 28u²|e₁||e₂|; if its largest component is above this times
/// |e₁||e₂|, by less than u of that.
pub const TRIANGLE_THICK: f64 = 64.0 * U;

/// Leaving a plane, docs/numerics.md §11: the height n·(o − p) is off by at most this times M·|o − p|, in largest
/// components; M is a triangle's |e₁||e₂| or the size of a given normal.
pub const LEAVING_HEIGHT: f64 = 400.0 * U * U;

/// Leaving a plane, docs/numerics.md §11: and n·d by this times M·|d|.
pub const LEAVING_SLOPE: f64 = 50.0 * U;

/// Plane, docs/numerics.md §3: the fast path takes a ray if the sums of absolute products are below this times |D| and
/// |N|.
pub const PLANE_CONDITION: f64 = (1 << 18) as f64;

/// Plane, docs/numerics.md §3: then λ, beyond its last rounding, is off by less than this times |λ|.
pub const PLANE_LAMBDA: f64 = U / 256.0;

/// Plane, docs/numerics.md §3: λ beyond its last rounding is off by this times u²κ(P_N/|D| + |λ|κ), where P are the
/// sums of the products' absolute values and κ = P_D/|D|.
pub const PLANE_QUOTIENT: f64 = 160.0 * U * U;

/// Polygon, docs/numerics.md §7: a vertex as the ray sees it, sₓd_z − s_zdₓ, is off by at most 6.1u·|s|∞|d|∞.
pub const POLYGON_COORDINATE: f64 = 7.0 * U;

/// Where splitting a factor could overflow; fast paths stay below, so that both kinds of
/// [`Product`](super::eft::Product) give the same bits.
pub const LARGE: f64 = f64::from_bits((1023 + 900) << 52);
