//! A square product, to measure the machine by.

use burn::tensor::{Device, Distribution, Tensor};

use crate::protocol::{Facts, Work};

/// Side of both matrices; `peers/gemm.py` has the same.
const SIDE: usize = 2048;

pub fn product() -> Work {
    let device = Device::flex();
    let [a, b] = [(); 2].map(|()| Tensor::<2>::random([SIDE, SIDE], Distribution::Default, &device));
    Work::new(Facts::new(), move || {
        std::hint::black_box(a.clone().matmul(b.clone()));
        Ok(())
    })
}
