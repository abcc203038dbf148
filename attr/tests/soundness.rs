//! The promises of the descent and of the polish, on meshes of all kinds.

mod progressive;
mod sound;

use arbitrary::Unstructured;
use proptest::prelude::*;
use rayon::ThreadPoolBuilder;
use sound::{Recipe, chains, check};

fn recipe(bytes: &[u8]) -> Recipe {
    Recipe::read(&mut Unstructured::new(bytes)).expect("missing bytes are zeros")
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn levels_of_any_mesh_are_sound(bytes in prop::collection::vec(any::<u8>(), 0..128)) {
        if let Some((mesh, levels)) = chains(&recipe(&bytes)) {
            levels.iter().for_each(|levels| check(&mesh, levels));
        }
    }

    #[test]
    fn levels_do_not_depend_on_the_number_of_threads(bytes in prop::collection::vec(any::<u8>(), 64)) {
        let on = |threads: usize| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| chains(&recipe(&bytes)))
        };
        let (one, three) = (on(1), on(3));
        prop_assert_eq!(one.is_some(), three.is_some());
        if let (Some((_, one)), Some((_, three))) = (one, three) {
            for (a, b) in one.iter().flatten().zip(three.iter().flatten()) {
                prop_assert_eq!(&a.mesh, &b.mesh);
            }
        }
    }
}
