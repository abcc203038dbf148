//! The influences of joints on a vertex between others.
//!
//! Skinning is linear in the weights: a point at barycentrics b of a triangle moves as Σ b_k w_kj of
//! each joint j, if it is to stay where it is on the moving triangle. So weights are summed by joint
//! over the corners. A part keeps the sets it has, and with them four influences a set: the strongest
//! stay, and are brought back to a sum of 1.

use gltf::json::accessor::ComponentType;

use crate::document::accessor::{Elements, Named};

/// Influences in a set (glTF 2.0 §3.7.3.3).
const A_SET: usize = 4;

/// The sets of influences of a part.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Sets {
    /// The indices of `JOINTS_n` and `WEIGHTS_n` among the attributes, by n.
    places: Vec<[usize; 2]>,
}

impl Sets {
    /// Finds the sets among attributes. None if there is none, or if they are not such that they can
    /// be blended: of one type, integers for joints and floats or normalized integers for weights.
    pub(crate) fn find(attributes: &[&Named]) -> Option<Self> {
        let place = |name: String| attributes.iter().position(|(own, _)| *own == name);
        let sets = (0..attributes.len()).map_while(|set| {
            Some([place(format!("JOINTS_{set}"))?, place(format!("WEIGHTS_{set}"))?])
        });
        let places: Vec<[usize; 2]> = sets.collect();
        let shapes = |set: &[usize; 2]| set.map(|place| attributes[place].1.shape());
        let [joints, weights] = shapes(places.first()?);
        let are_joints = matches!(joints, (ComponentType::U8 | ComponentType::U16, A_SET, false));
        let are_weights = matches!(
            weights,
            (ComponentType::F32, A_SET, _) | (ComponentType::U8 | ComponentType::U16, A_SET, true)
        );
        let are_alike = places.iter().all(|set| shapes(set) == [joints, weights]);
        (are_joints && are_weights && are_alike).then_some(Self { places })
    }

    /// The influences on a vertex of the given attributes.
    pub(crate) fn influences(&self, attributes: &[&Named], vertex: usize) -> Vec<(u32, f64)> {
        let mut all = Vec::new();
        for set in &self.places {
            let [joints, weights] = set.map(|place| attributes[place].1.row(vertex));
            let weights = weights.into_iter().map(f64::from);
            all.extend(joints.into_iter().map(|joint| joint as u32).zip(weights));
        }
        all
    }

    /// Blends the influences of vertices, each given as the attributes it is in, its number and its
    /// share: places among the attributes, with the bytes of one element for each. None if there is
    /// no weight to speak of.
    pub(crate) fn blend(
        &self,
        corners: &[(&[&Named], usize, f64)],
    ) -> Option<Vec<(usize, Vec<u8>)>> {
        let own = |&(attributes, vertex, share): &(&[&Named], usize, f64)| {
            let own = self.influences(attributes, vertex).into_iter();
            own.map(move |(joint, weight)| (joint, weight * share))
        };
        let all = corners.iter().flat_map(own).collect();
        self.encode(all, corners.first()?.0)
    }

    /// The influences on a vertex of the given attributes, the strongest of them brought to a sum of 1, as
    /// [`Self::blend`] gives them.
    pub(crate) fn encode(
        &self,
        all: Vec<(u32, f64)>,
        attributes: &[&Named],
    ) -> Option<Vec<(usize, Vec<u8>)>> {
        let kept = strongest(all, A_SET * self.places.len())?;
        let weights = round(&kept, &attributes[self.places[0][1]].1);
        let mut rows = vec![(0.0, 0.0); A_SET * self.places.len()];
        for (row, ((joint, _), weight)) in rows.iter_mut().zip(kept.into_iter().zip(weights)) {
            if weight > 0.0 {
                *row = (joint as f32, weight);
            }
        }
        let sets = self.places.iter().zip(rows.chunks_exact(A_SET));
        let encode = |([joints, weights], rows): (&[usize; 2], &[(f32, f32)])| {
            let element =
                |place: usize, values: Vec<f32>| (place, attributes[place].1.encode(values));
            [
                element(*joints, rows.iter().map(|row| row.0).collect()),
                element(*weights, rows.iter().map(|row| row.1).collect()),
            ]
        };
        Some(sets.flat_map(encode).collect())
    }
}

/// Sums influences by joint, keeps the `most` strongest and brings them to a sum of 1; the strongest
/// first, equal ones by joint. None if they have no weight.
fn strongest(mut all: Vec<(u32, f64)>, most: usize) -> Option<Vec<(u32, f64)>> {
    all.retain(|&(_, weight)| weight.is_finite() && weight > 0.0);
    all.sort_by_key(|&(joint, _)| joint);
    let mut sums: Vec<(u32, f64)> = all
        .chunk_by(|a, b| a.0 == b.0)
        .map(|run| (run[0].0, run.iter().map(|&(_, weight)| weight).sum()))
        .collect();
    sums.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    sums.truncate(most);
    let whole: f64 = sums.iter().map(|&(_, weight)| weight).sum();
    sums.iter_mut().for_each(|(_, weight)| *weight /= whole);
    (!sums.is_empty()).then_some(sums)
}

/// The weights as `like` can store them.
fn round(influences: &[(u32, f64)], like: &Elements) -> Vec<f32> {
    let whole = match like.component {
        ComponentType::U8 => f64::from(u8::MAX),
        ComponentType::U16 => f64::from(u16::MAX),
        _ => return influences.iter().map(|&(_, weight)| weight as f32).collect(),
    };
    let shares: Vec<f64> = influences.iter().map(|&(_, weight)| weight).collect();
    round_to_whole(&shares, whole).into_iter().map(|x| (x / whole) as f32).collect()
}

/// Shares of 1 as integers that add up to the whole exactly: what rounding down leaves goes to those
/// that lost most by it, the first of them first (the method of largest remainders).
pub(crate) fn round_to_whole(shares: &[f64], whole: f64) -> Vec<f64> {
    let exact: Vec<f64> = shares.iter().map(|share| share * whole).collect();
    let mut units: Vec<f64> = exact.iter().map(|x| x.floor()).collect();
    let mut order: Vec<usize> = (0..exact.len()).collect();
    order.sort_by(|&a, &b| (exact[b] - units[b]).total_cmp(&(exact[a] - units[a])).then(a.cmp(&b)));
    let left = whole - units.iter().sum::<f64>();
    order.iter().take(left as usize).for_each(|&at| units[at] += 1.0);
    units
}

#[cfg(test)]
mod tests {
    use super::*;

    fn elements(component: ComponentType, values: &[f32]) -> Elements {
        let normalized = component != ComponentType::F32;
        let mut elements = Elements { bytes: Vec::new(), component, components: 4, normalized };
        elements.bytes = elements.encode(values.iter().copied());
        elements
    }

    fn skin(sets: &[(&[f32], &[f32])], component: ComponentType) -> Vec<Named> {
        let set = |(n, (joints, weights)): (usize, &(&[f32], &[f32]))| {
            let bytes = joints.iter().map(|&joint| joint as u8).collect();
            let (component_of_joints, components) = (ComponentType::U8, 4);
            let joints =
                Elements { bytes, component: component_of_joints, components, normalized: false };
            [
                (format!("JOINTS_{n}"), joints),
                (format!("WEIGHTS_{n}"), elements(component, weights)),
            ]
        };
        sets.iter().enumerate().flat_map(set).collect()
    }

    /// The influences of a blend, and the bytes of the weights of all sets.
    fn blend(skin: &[Named], shares: &[f64]) -> (Vec<(u32, f32)>, Vec<Vec<u8>>) {
        let attributes: Vec<&Named> = skin.iter().collect();
        let corners: Vec<(&[&Named], usize, f64)> = shares
            .iter()
            .enumerate()
            .map(|(vertex, &share)| (attributes.as_slice(), vertex, share))
            .collect();
        let blended = Sets::find(&attributes).unwrap().blend(&corners).unwrap();
        let row = |(place, bytes): &(usize, Vec<u8>)| {
            Elements { bytes: bytes.clone(), ..attributes[*place].1 }.floats()
        };
        let rows: Vec<Vec<f32>> = blended.iter().map(row).collect();
        let influences = rows.chunks_exact(2).flat_map(|set| {
            set[0].iter().map(|&joint| joint as u32).zip(set[1].iter().copied()).collect::<Vec<_>>()
        });
        (influences.collect(), blended.iter().skip(1).step_by(2).map(|b| b.1.clone()).collect())
    }

    const A: &[f32] = &[5.0, 2.0, 0.0, 0.0, 2.0, 7.0, 0.0, 0.0];
    const W: &[f32] = &[0.75, 0.25, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0];

    #[test]
    fn weights_are_summed_by_joint_and_equal_ones_sorted_by_it() {
        let skin = skin(&[(A, W)], ComponentType::F32);
        let (influences, _) = blend(&skin, &[0.5, 0.5]);
        assert_eq!(influences, [(2, 0.375), (5, 0.375), (7, 0.25), (0, 0.0)]);
    }

    #[test]
    fn the_weakest_of_too_many_go_and_the_rest_sums_to_one() {
        let joints = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
        let weights = [0.4, 0.3, 0.2, 0.1, 0.4, 0.3, 0.2, 0.1];
        let one = skin(&[(&joints, &weights)], ComponentType::F32);
        let (influences, _) = blend(&one, &[0.5, 0.5]);
        assert_eq!(influences.iter().map(|i| i.0).collect::<Vec<_>>(), [0, 4, 1, 5]);
        assert!((influences.iter().map(|i| i.1).sum::<f32>() - 1.0).abs() < 1e-6);
        let zeros = [0.0; 8];
        let two = skin(&[(&joints, &weights), (&zeros, &zeros)], ComponentType::F32);
        let (influences, _) = blend(&two, &[0.5, 0.5]);
        assert_eq!(influences.iter().filter(|i| i.1 > 0.0).count(), 8, "two sets hold eight");
    }

    #[test]
    fn integers_sum_to_the_whole_exactly() {
        let joints: Vec<f32> = (0..12).map(|joint| joint as f32).collect();
        let weights = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.4, 0.2, 0.2, 0.2];
        for shares in [[1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0], [0.7, 0.299, 0.001], [0.1, 0.2, 0.7]] {
            let (_, bytes) = blend(&skin(&[(&joints, &weights)], ComponentType::U8), &shares);
            assert_eq!(bytes[0].iter().map(|&b| u32::from(b)).sum::<u32>(), 255);
            let (_, bytes) = blend(&skin(&[(&joints, &weights)], ComponentType::U16), &shares);
            let words = bytes[0].as_chunks().0.iter().map(|&b| u32::from(u16::from_le_bytes(b)));
            assert_eq!(words.sum::<u32>(), 65535);
        }
    }

    #[test]
    fn what_cannot_be_blended_is_told() {
        let no_weight = skin(&[(A, &[0.0, f32::NAN, -1.0, 0.0])], ComponentType::F32);
        let attributes: Vec<&Named> = no_weight.iter().collect();
        let sets = Sets::find(&attributes).unwrap();
        assert_eq!(sets.blend(&[(&attributes, 0, 1.0)]), None);
        assert_eq!(Sets::find(&attributes[..1]), None, "joints without weights");
        assert_eq!(Sets::find(&[]), None);
        let mut mixed = skin(&[(A, W), (A, W)], ComponentType::F32);
        mixed[3].1 = elements(ComponentType::U8, W);
        assert_eq!(Sets::find(&mixed.iter().collect::<Vec<_>>()), None);
    }
}
