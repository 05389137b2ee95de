//! Leading features of a window or of a segment's centre, quantised to 16 bits, and their distance.

/// Leading principal features of a segment's centre that are always compared.
pub(crate) const LEAD: usize = 32;
/// Leading features of a centre, in steps of the quantisation.
pub(crate) type Lead = [i16; LEAD];

/// Largest quantised number of a centre, and of a query. Their differences fit 16 bits, 32 squared ones 32 bits.
pub(crate) const MAX_CENTRE: f32 = 3_000.0;
pub(crate) const MAX_QUERY: f32 = 8_000.0;

/// Squared distance, steps². Never overflows: see [`MAX_QUERY`].
#[inline(always)]
pub(crate) fn step_distance(a: &Lead, b: &Lead) -> u32 {
    let mut sum = 0i32;
    for (x, y) in a.iter().zip(b) {
        let d = i32::from(x.wrapping_sub(*y));
        sum = sum.wrapping_add(d * d);
    }
    sum as u32
}

pub(crate) fn quantised(value: f32, scale: f32, max: f32) -> i16 {
    (value * scale).round().clamp(-max, max) as i16
}

pub(crate) fn quantised_lead(features: &[f32], scale: f32, max: f32) -> Lead {
    let mut lead = [0; LEAD];
    for (out, v) in lead.iter_mut().zip(features) {
        *out = quantised(*v, scale, max);
    }
    lead
}
