//! The descriptors in which the webcam states its formats and its endpoint.

/// The frame sizes, by frame index from 1.
pub const FRAME_SIZES: [(u16, u16); 2] = [(640, 480), (320, 240)];
/// Maximum size of a frame.
pub const MAX_PAYLOAD_BYTES: u32 = 1 << 20;
/// Frame interval in units of 100 ns: 20 frames per second.
const INTERVAL: u32 = 500_000;

/// The negotiated stream: format 1 and this frame index.
pub fn probe(frame: u8) -> [u8; 26] {
    let mut probe = [0; 26];
    (probe[2], probe[3]) = (1, frame.max(1));
    probe[4..8].copy_from_slice(&INTERVAL.to_le_bytes());
    probe[18..22].copy_from_slice(&MAX_PAYLOAD_BYTES.to_le_bytes());
    probe[22..26].copy_from_slice(&MAX_PAYLOAD_BYTES.to_le_bytes());
    probe
}

/// Device (1), configuration (2) and strings (3).
pub fn descriptor(kind: u8, index: u8) -> Option<Vec<u8>> {
    match (kind, index) {
        // Vendor 0x1209, product 1: numbers of pid.codes for tests.
        (1, _) => Some(vec![18, 1, 0, 2, 0xef, 2, 1, 64, 0x09, 0x12, 1, 0, 0, 1, 0, 1, 0, 1]),
        (2, _) => Some(configuration()),
        (3, 0) => Some(vec![4, 3, 9, 4]),
        (3, 1) => {
            let text: Vec<u8> = "sdg test webcam".encode_utf16().flat_map(u16::to_le_bytes).collect();
            Some([&[2 + text.len() as u8, 3], text.as_slice()].concat())
        }
        _ => None,
    }
}

fn configuration() -> Vec<u8> {
    let control = with_total_length(
        [
            // Version 1.0, clock 48 MHz, stream interface 1.
            &[13, 0x24, 1, 0, 1, 0, 0, 0, 0x6c, 0xdc, 2, 1, 1][..],
            // Camera terminal 1 with exposure mode (bit 1) and exposure time (bit 3).
            &[18, 0x24, 2, 1, 1, 2, 0, 0, 0, 0, 0, 0, 0, 0, 3, 0x0a, 0, 0],
            // Processing unit 2 after terminal 1, with white balance temperature (bit 6), automatic or not (bit 12).
            &[11, 0x24, 5, 2, 1, 0, 0, 2, 0x40, 0x10, 0],
            // Output terminal 3 after unit 2.
            &[9, 0x24, 3, 3, 1, 1, 0, 2, 0],
        ]
        .concat(),
        5,
    );
    let frames = FRAME_SIZES.iter().zip(1..).flat_map(|(&(width, height), index)| {
        let rates = [INTERVAL.to_le_bytes(), MAX_PAYLOAD_BYTES.to_le_bytes()];
        let [interval, bytes] = rates;
        let sizes = [width.to_le_bytes(), height.to_le_bytes()].concat();
        [&[30, 0x24, 7, index, 0], sizes.as_slice(), &[0; 4], &[0; 4], &bytes, &interval, &[1], &interval].concat()
    });
    let format = [11, 0x24, 6, 1, FRAME_SIZES.len() as u8, 1, 1, 0, 0, 0, 0];
    let input = [14, 0x24, 1, 1, 0, 0, 0x81, 0, 3, 0, 0, 0, 1, 0];
    let stream = with_total_length(input.into_iter().chain(format).chain(frames).collect(), 4);
    let all = [
        &[9, 2, 0, 0, 2, 1, 0, 0x80, 50][..],
        // Both interfaces are one function: video (0x0e), interface collection (3).
        &[8, 11, 0, 2, 0x0e, 3, 0, 0],
        &[9, 4, 0, 0, 0, 0x0e, 1, 0, 0],
        &control,
        &[9, 4, 1, 0, 1, 0x0e, 2, 0, 0],
        &stream,
        // Bulk endpoint 0x81, 512 bytes.
        &[7, 5, 0x81, 2, 0, 2, 0],
    ]
    .concat();
    with_total_length(all, 2)
}

/// Writes the total length into the first descriptor.
fn with_total_length(mut bytes: Vec<u8>, at: usize) -> Vec<u8> {
    let length = (bytes.len() as u16).to_le_bytes();
    bytes[at..at + 2].copy_from_slice(&length);
    bytes
}
