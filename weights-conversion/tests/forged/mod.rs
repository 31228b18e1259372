//! Checkpoint files built byte by byte, with contents that no regular writer makes.

/// A sequence of parts.
pub fn cat(parts: &[&[u8]]) -> Vec<u8> {
    parts.concat()
}

/// A text of at most 255 bytes, as a pickle operation.
pub fn text(text: &str) -> Vec<u8> {
    cat(&[&[0x8c, text.len() as u8], text.as_bytes()])
}

/// A pickled dict of one name; `value` contains the operations for its value.
pub fn dict_with(name: &str, value: &[u8]) -> Vec<u8> {
    cat(&[b"\x80\x04}", &text(name), value, b"s."])
}

fn int(value: i64) -> Vec<u8> {
    cat(&[&[0x8a, 8], &value.to_le_bytes()])
}

/// The pickle operations for a numpy array as numpy writes it, of any shape, type and bytes.
pub fn array(shape: &[i64], code: &str, order: &str, bytes: &[u8]) -> Vec<u8> {
    let sizes: Vec<u8> = shape.iter().flat_map(|size| int(*size)).collect();
    let no_fields = b"NNNJ\xff\xff\xff\xffJ\xff\xff\xff\xffK\x00tb";
    let dtype = cat(&[b"cnumpy\ndtype\n", &text(code), b"\x89\x88\x87R(K\x03", &text(order), no_fields]);
    cat(&[
        b"cnumpy.core.multiarray\n_reconstruct\ncnumpy\nndarray\nK\x00\x85C\x01b\x87R(K\x01(",
        &sizes,
        b"t",
        &dtype,
        b"\x89B",
        &(bytes.len() as u32).to_le_bytes(),
        bytes,
        b"tb",
    ])
}

/// A pickled dict of such an array.
pub fn array_pickle(shape: &[i64], code: &str, order: &str, bytes: &[u8]) -> Vec<u8> {
    dict_with("w", &array(shape, code, order, bytes))
}

/// A zip archive of uncompressed entries with correct checksums.
pub fn zip(entries: &[(&str, &[u8])]) -> Vec<u8> {
    let (mut file, mut directory) = (Vec::new(), Vec::new());
    for (name, content) in entries {
        let header_at = (file.len() as u32).to_le_bytes();
        let name_len = (name.len() as u16).to_le_bytes();
        let size = (content.len() as u32).to_le_bytes();
        let sums = [crc32fast::hash(content).to_le_bytes(), size, size].concat();
        let header = cat(&[b"PK\x03\x04\x14\0\0\0\0\0\0\0\0\0", &sums, &name_len, &[0, 0], name.as_bytes()]);
        file.extend(cat(&[&header, content]));
        let fields = cat(&[b"PK\x01\x02\x14\0\x14\0\0\0\0\0\0\0\0\0", &sums, &name_len, &[0; 12], &header_at]);
        directory.extend(cat(&[&fields, name.as_bytes()]));
    }
    let count = (entries.len() as u16).to_le_bytes();
    let place = [(directory.len() as u32).to_le_bytes(), (file.len() as u32).to_le_bytes()].concat();
    cat(&[&file, &directory, b"PK\x05\x06\0\0\0\0", &count, &count, &place, &[0, 0]])
}

/// torch's legacy format: magic, version, system, the pickle, storage keys, storages (key, elements, bytes).
pub fn legacy(pickle: &[u8], storages: &[(&str, u64, &[u8])]) -> Vec<u8> {
    let magic = b"\x80\x02\x8a\x0a\x6c\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19.";
    let keys: Vec<u8> = storages.iter().flat_map(|(key, _, _)| text(key)).collect();
    let contents = storages.iter().flat_map(|(_, count, bytes)| cat(&[&count.to_le_bytes(), bytes]));
    let head = cat(&[magic, b"\x80\x02M\xe9\x03.", b"\x80\x02}.", pickle, b"\x80\x02](", &keys, b"e."]);
    head.into_iter().chain(contents).collect()
}
