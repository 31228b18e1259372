//! Converts the searched region between the page's type and the grasp models' type.

use sdg_annotate::Region;
use sdg_grasp::SearchRegion;

pub(crate) fn search_region(region: &Region) -> SearchRegion {
    let Region { x, y, width, height, picture } = *region;
    SearchRegion { picture, ..SearchRegion::new([x, y, width, height]) }
}

pub(crate) fn page_region(region: &SearchRegion) -> Region {
    let SearchRegion { x, y, width, height, picture } = *region;
    Region { x, y, width, height, picture }
}
