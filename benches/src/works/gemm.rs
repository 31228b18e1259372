//! A product of square matrices, which measures the machine.

use burn::tensor::{Device, Distribution, Tensor};

use crate::protocol::{Facts, Work};

/// Side of both matrices, as in `peers/gemm.py`.
const SIDE: usize = 2048;

pub fn product() -> Work {
    let device = Device::flex();
    let [a, b] = [(); 2].map(|()| Tensor::<2>::random([SIDE, SIDE], Distribution::Default, &device));
    Work::new(Facts::new(), move || {
        std::hint::black_box(a.clone().matmul(b.clone()));
        Ok(())
    })
}
