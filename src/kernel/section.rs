//! Where a line enters and leaves a closed convex solid: the ends of the section it cuts out, as roots of polynomials,
//! over any [`Number`].
//!
//! The cold half of [`sphere`](super::sphere) and [`frustum`](super::frustum). An end is compared with an interval's
//! limit by the signs of polynomials in that limit, never by a rounded λ; docs/numerics.md §5.

use super::number::Number;
use super::scaled::{SCALED_ERROR, Scaled};
use crate::hit::Hit;
use crate::interval::Interval;
use glam::DVec2;
use std::cmp::Ordering;

/// The arithmetic could not tell a sign, or knows λ too badly: the next tier must.
#[derive(Clone, Copy, Debug)]
pub(super) struct Undecided;

/// `Undecided` where there is no sign.
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

/// λ is good enough if it is known to a thousandth of an ulp; a NaN is not.
fn is_sharp(relative: f64) -> bool {
    relative <= super::bound::U / 1024.0
}

impl<N: Number> End<'_, N> {
    /// λ and a bound on its relative error; infinite where it is not known.
    pub(super) fn lambda(&self) -> (Scaled, f64) {
        let ratio = |(p, p_error): (Scaled, f64), (q, q_error): (Scaled, f64)| {
            if q.is_zero() {
                return (Scaled::ZERO, f64::INFINITY);
            }
            // (1 + p)(1 + op)/(1 − q) ≤ 1 + 1.01·(p + q + op) for errors below 2⁻⁸.
            let error = 1.01 * (p_error + q_error + SCALED_ERROR);
            (p.over(q), if error < 1.0 / 256.0 { error } else { f64::INFINITY })
        };
        match self {
            Self::Plane { value, rate } => ratio(value.negated().rounded(), rate.rounded()),
            Self::Falling(q) => q.root(true, ratio),
            Self::Rising(q) => q.root(false, ratio),
        }
    }

    /// λ compared with `m`.
    fn compare(&self, m: f64) -> Result<Ordering, Undecided> {
        if m.is_infinite() {
            return Ok(if m > 0.0 { Ordering::Less } else { Ordering::Greater });
        }
        let (lambda, relative) = self.lambda();
        let (value, rounding) = lambda.to_f64();
        if value.is_finite() {
            let error = (rounding + relative * value.abs()) * 1.01;
            if value - error > m {
                return Ok(Ordering::Greater);
            }
            if value + error < m {
                return Ok(Ordering::Less);
            }
        }
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

impl<N: Number> Quadratic<N> {
    /// The root at which the polynomial falls or rises: (−b ∓ √D)/a, by the form that does not cancel. It must exist.
    fn root(&self, falling: bool, ratio: impl Fn((Scaled, f64), (Scaled, f64)) -> (Scaled, f64)) -> (Scaled, f64) {
        let (b, b_error) = self.b.rounded();
        let (discriminant, d_error) = self.discriminant.rounded();
        // |√(1 + e) − 1| ≤ |e| for |e| ≤ 1.
        let root_error = if d_error <= 1.0 { d_error + SCALED_ERROR } else { f64::INFINITY };
        if discriminant.is_negative() {
            return (Scaled::ZERO, f64::INFINITY);
        }
        let q = b.abs().plus(discriminant.sqrt());
        if q.is_zero() {
            // b = D = 0: a double root at zero.
            let known = b_error == 0.0 && d_error == 0.0;
            return (Scaled::ZERO, if known { 0.0 } else { f64::INFINITY });
        }
        let q_error = if b_error > root_error { b_error } else { root_error } + SCALED_ERROR;
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

/// The nearest of the two ends that lies inside `within`, each with the part it is on.
pub(super) fn nearest<N: Number>(ends: [(End<N>, u32); 2], within: Interval) -> Result<Option<Hit>, Undecided> {
    for (end, part) in ends {
        if end.compare(within.min)?.is_gt() {
            return if end.compare(within.max)?.is_lt() { hit(&end, part).map(Some) } else { Ok(None) };
        }
    }
    Ok(None)
}

fn hit<N: Number>(end: &End<N>, part: u32) -> Result<Hit, Undecided> {
    let (exact, relative) = end.lambda();
    if !is_sharp(relative) {
        return Err(Undecided);
    }
    let (lambda, rounding) = exact.to_f64();
    if lambda.is_infinite() {
        return Ok(Hit { lambda: f64::MAX.copysign(lambda), error: f64::INFINITY, uv: DVec2::ZERO, part });
    }
    let error = (rounding + relative * lambda.abs()) * super::bound::INFLATE;
    Ok(Hit { lambda, error, uv: DVec2::ZERO, part })
}

/// Of two ends the λ nearest to `lambda`, to a hundred bits; `None` where this arithmetic knows less.
pub(super) fn precise<N: Number>(ends: &[End<N>; 2], lambda: f64) -> Result<[f64; 2], Undecided> {
    let (enter, enter_error) = ends[0].lambda();
    let (exit, exit_error) = ends[1].lambda();
    if !is_sharp(enter_error) || !is_sharp(exit_error) {
        return Err(Undecided);
    }
    let at = Scaled::new(lambda, 0.0, 0);
    let (from_enter, from_exit) = (enter.minus(at).abs(), exit.minus(at).abs());
    let (hi, lo) = if from_exit.minus(from_enter).is_negative() { exit.to_pair() } else { enter.to_pair() };
    Ok([hi, lo])
}

/// `decide` in double-double, and exactly where that cannot tell.
macro_rules! refined {
    ($decide:ident($($argument:expr),*)) => {
        $decide::<$crate::kernel::bounded::Bounded>($($argument),*)
            .or_else(|_| $decide::<$crate::kernel::dyadic::Dyadic>($($argument),*))
    };
}
pub(super) use refined;
