use sdg_simulation::scene::test_views;
fn main() {
    let path = std::env::args().nth(1).unwrap();
    let object = sdg_simulation::objects::ObjectSpec::by_name("pendulum").unwrap();
    let model = sdg_grasp::GraspModel::from_bytes(&std::fs::read(path).unwrap(), &sdg_grasp::Device::flex()).unwrap();
    for (i, seen) in test_views(&object, false, 50, 1000).enumerate() {
        let seen = seen.unwrap();
        for d in model.detect(&seen.view.image, sdg_grasp::Verification::ByShape).unwrap().iter().take(2) {
            if d.score > 0.05 {
                println!("{i} {:.3} {:?} {:?}", d.score, d.evidence, d.bbox);
            }
        }
    }
}
