//! Where a line enters and leaves a closed convex solid: the ends of the section it cuts out, as roots of polynomials,
//! over any [`Number`].
//!
//! The cold half of [`sphere`](super::sphere) and [`frustum`](super::frustum). An end is compared with an interval's
//! limit by the signs of polynomials in that limit, never by a rounded λ; docs/numerics.md §5.

use super::number::Number;
use super::scaled::{SCALED_ERROR, Scaled};
use crate::hit::Hit;
use crate::interval::Interval;
use crate::ray::Ray;
use glam::DVec2;
use std::cmp::Ordering;

/// The arithmetic could not tell a sign, or knows λ too badly: the next tier must.
#[derive(Clone, Copy, Debug)]
pub(super) struct Undecided;

/// `Undecided` where there is no sign.
#[inline(always)]
pub(super) fn sign<N: Number>(n: &N) -> Result<Ordering, Undecided> {
    n.sign().ok_or(Undecided)
}

/// aλ² + 2bλ + c and its discriminant b² − ac, from whatever form of it cancels least.
#[derive(Clone, Debug)]
pub(super) struct Quadratic<N> {
    pub(super) a: N,
    pub(super) b: N,
    pub(super) c: N,
    pub(super) discriminant: N,
}

/// One end of the section.
#[derive(Clone, Debug)]
pub(super) enum End<'a, N> {
    /// In a plane: value + λ·rate = 0.
    Plane { value: N, rate: &'a N },
    /// On the quadric, where it is entered: the root at which the polynomial falls.
    Falling(&'a Quadratic<N>),
    /// On the quadric, where it is left: the root at which the polynomial rises.
    Rising(&'a Quadratic<N>),
}

/// An end's λ: exactly within `relative` of `exact`, and within `error` of `rounded`.
#[derive(Clone, Copy, Debug)]
struct Lambda {
    exact: Scaled,
    relative: f64,
    rounded: f64,
    error: f64,
}

impl Lambda {
    fn new((exact, relative): (Scaled, f64)) -> Self {
        let (rounded, rounding) = exact.to_f64();
        let error = if rounded.is_finite() {
            (rounding + relative * rounded.abs()) * super::bound::INFLATE
        } else {
            f64::INFINITY
        };
        Self { exact, relative, rounded, error }
    }

    /// Good enough if it is known to a thousandth of its ulp, or to a quarter of an ulp of `fine`; a NaN is not.
    fn is_sharp(&self, fine: f64) -> bool {
        use super::bound::U;
        self.relative <= U / 1024.0 || self.relative * self.rounded.abs() <= 0.25 * U * fine
    }
}

impl<N: Number> End<'_, N> {
    /// λ and a bound on its relative error; infinite where it is not known.
    fn lambda(&self) -> Lambda {
        Lambda::new(match self {
            Self::Plane { value, rate } => ratio(value.negated().rounded(), rate.rounded()),
            Self::Falling(q) => q.root(true),
            Self::Rising(q) => q.root(false),
        })
    }

    /// λ compared with `m`.
    fn compare(&self, lambda: &Lambda, m: f64) -> Result<Ordering, Undecided> {
        if m.is_infinite() {
            return Ok(0f64.total_cmp(&m));
        }
        if lambda.rounded - lambda.error > m {
            return Ok(Ordering::Greater);
        }
        if lambda.rounded + lambda.error < m {
            return Ok(Ordering::Less);
        }
        self.compare_exactly(m)
    }

    #[cold]
    fn compare_exactly(&self, m: f64) -> Result<Ordering, Undecided> {
        let at = N::exactly(m);
        match self {
            Self::Plane { value, rate } => {
                // value + m·rate has rate's sign where m is beyond λ.
                let beyond = sign(&value.plus(&at.times(rate)))?;
                Ok(if sign(*rate)?.is_gt() { beyond.reverse() } else { beyond })
            }
            Self::Falling(q) => q.compare(&at, true),
            Self::Rising(q) => q.compare(&at, false),
        }
    }
}

/// p/q and a bound on its relative error.
fn ratio((p, p_error): (Scaled, f64), (q, q_error): (Scaled, f64)) -> (Scaled, f64) {
    if q.is_zero() {
        return (Scaled::ZERO, f64::INFINITY);
    }
    // (1 + p)(1 + op)/(1 − q) ≤ 1 + 1.01·(p + q + op) for errors below 2⁻⁸.
    let error = 1.01 * (p_error + q_error + SCALED_ERROR);
    (p.over(q), if error < 1.0 / 256.0 { error } else { f64::INFINITY })
}

impl<N: Number> Quadratic<N> {
    /// The root at which the polynomial falls or rises: (−b ∓ √D)/a, by the form that does not cancel. It must exist.
    fn root(&self, falling: bool) -> (Scaled, f64) {
        let (b, b_error) = self.b.rounded();
        let (discriminant, d_error) = self.discriminant.rounded();
        // |√(1 + e) − 1| ≤ |e| for |e| ≤ 1.
        let root_error = if d_error <= 1.0 { d_error + SCALED_ERROR } else { f64::INFINITY };
        if discriminant.is_negative() {
            return (Scaled::ZERO, f64::INFINITY);
        }
        let root = discriminant.sqrt();
        let q = b.abs().plus(root);
        if q.is_zero() {
            // b = D = 0: a double root at zero.
            let known = b_error == 0.0 && d_error == 0.0;
            return (Scaled::ZERO, if known { 0.0 } else { f64::INFINITY });
        }
        // Each part's error in proportion to what it adds: a grazing ray's √D is small, and badly known.
        let q_error = b_error + 1.01 * root_error * root.quotient(q) + SCALED_ERROR;
        // Falling: −(|b| + √D)/a for b ≥ 0, c/(|b| + √D) for b < 0; rising: the same with b's and λ's sign turned.
        let (lambda, error) = if b.is_negative() == falling && !b.is_zero() {
            ratio(self.c.rounded(), (q, q_error))
        } else {
            let (l, e) = ratio((q, q_error), self.a.rounded());
            (l.negated(), e)
        };
        (if falling { lambda } else { lambda.negated() }, error)
    }

    /// The falling or rising root compared with `m`: by the signs of the polynomial at m and of its slope there.
    ///
    /// With P and 2G value and slope at m, m − λ = (G ∓ √D)/a and D = G² − aP: for the rising root the sign of P where
    /// G ≥ 0, else that of −a; mirrored for the falling one.
    fn compare(&self, m: &N, falling: bool) -> Result<Ordering, Undecided> {
        let slope = self.a.times(m).plus(&self.b);
        let value = slope.plus(&self.b).times(m).plus(&self.c);
        let slope = sign(&slope)?;
        let m_against_lambda = if falling {
            if slope.is_le() { sign(&value)?.reverse() } else { sign(&self.a)? }
        } else if slope.is_ge() {
            sign(&value)?
        } else {
            sign(&self.a)?.reverse()
        };
        Ok(m_against_lambda.reverse())
    }
}

/// The nearest of the two ends that lies inside `within`, each with the part it is on. An error of a quarter of an ulp
/// of `fine` will do.
#[inline(always)]
pub(super) fn nearest<N: Number>(
    [(enter, enter_part), (exit, exit_part)]: [(End<N>, u32); 2],
    within: Interval,
    fine: f64,
) -> Result<Option<Hit>, Undecided> {
    match inside(&enter, enter_part, within, fine)? {
        Place::Before => {}
        Place::Inside(hit) => return Ok(Some(hit)),
        Place::Beyond => return Ok(None),
    }
    match inside(&exit, exit_part, within, fine)? {
        Place::Inside(hit) => Ok(Some(hit)),
        Place::Before | Place::Beyond => Ok(None),
    }
}

/// Where an end lies against an interval.
enum Place {
    Before,
    Inside(Hit),
    Beyond,
}

fn inside<N: Number>(end: &End<N>, part: u32, within: Interval, fine: f64) -> Result<Place, Undecided> {
    let lambda = end.lambda();
    if end.compare(&lambda, within.min)?.is_le() {
        return Ok(Place::Before);
    }
    if end.compare(&lambda, within.max)?.is_ge() {
        return Ok(Place::Beyond);
    }
    if !lambda.is_sharp(fine) {
        return Err(Undecided);
    }
    // Beyond the largest float it is that, and nothing is promised of it.
    let rounded = lambda.rounded.clamp(-f64::MAX, f64::MAX);
    Ok(Place::Inside(Hit { lambda: rounded, error: lambda.error, uv: DVec2::ZERO, part }))
}

/// An ulp of this part of the largest coordinate over |direction| is the least that is promised of λ.
pub(super) const FINE: f64 = 1.0 / (1u64 << 40) as f64;

/// What is 2⁻⁴⁰ of the largest coordinate of ray and shape over |direction| at most: an ulp of it is the least that is
/// promised of λ. Zero where that cannot be computed.
#[inline(always)]
pub(super) fn fine(ray: &Ray, extent: f64) -> f64 {
    let direction = 1.75 * ray.direction.abs().max_element();
    let fine = ray.origin.abs().max_element().max(extent) * FINE / direction;
    if fine < f64::INFINITY { fine } else { 0.0 }
}

/// What [`precise`] promises: exact arithmetic and the few operations after it reach 2⁻⁹⁸.
const PRECISE: f64 = f64::from_bits((1023 - 94) << 52); // 2⁻⁹⁴

/// Of two ends the λ nearest to `lambda`, the first if it is within an ulp (next to an apex both may be), to a hundred
/// bits; undecided where this arithmetic knows less.
pub(super) fn precise<N: Number>(ends: &[End<N>; 2], lambda: f64) -> Result<[f64; 2], Undecided> {
    let (enter, exit) = (ends[0].lambda(), ends[1].lambda());
    // A NaN is not below it.
    let known = |l: &Lambda| l.relative <= PRECISE;
    if !known(&enter) || !known(&exit) {
        return Err(Undecided);
    }
    let at = Scaled::new(lambda, 0.0, 0);
    let (from_enter, from_exit) = (enter.exact.minus(at).abs(), exit.exact.minus(at).abs());
    let ulp = Scaled::new(2.0 * super::bound::U * lambda.abs(), 0.0, 0);
    let is_enter = from_enter.minus(ulp).is_negative() || !from_exit.minus(from_enter).is_negative();
    let nearest = if is_enter { enter } else { exit };
    let (hi, lo) = nearest.exact.to_pair();
    Ok([hi, lo])
}

/// `decide` in double-double, and exactly where that cannot tell. It must be inlined whole.
macro_rules! refined {
    ($decide:ident($($argument:expr),*)) => {
        $crate::kernel::cpu::dispatch(
            #[inline(always)]
            || $decide::<$crate::kernel::bounded::Bounded<$crate::kernel::eft::Fused>>($($argument),*),
            #[inline(always)]
            || $decide::<$crate::kernel::bounded::Bounded<$crate::kernel::eft::Split>>($($argument),*),
        )
        .or_else(|_| {
            $crate::kernel::tally::exact();
            $decide::<$crate::kernel::dyadic::Dyadic>($($argument),*)
        })
    };
}
pub(super) use refined;
