//! Generates include/sdg.h from `types` and `functions`, so that the header always agrees with the library.
//!
//! It parses only the Rust syntax used in those two files, and fails on anything else.

use std::fmt::Write;

/// The C declaration of a name with a Rust type.
fn declaration(rust: &str, name: &str) -> String {
    let rust = rust.trim();
    if let Some(inner) = rust.strip_prefix("*const ") {
        return format!("const {}", declaration(inner, &format!("*{name}")));
    }
    if let Some(inner) = rust.strip_prefix("*mut ") {
        return declaration(inner, &format!("*{name}"));
    }
    if let Some((inner, length)) = rust.strip_prefix('[').and_then(|array| array.strip_suffix(']')?.split_once("; ")) {
        return declaration(inner, &format!("{name}[{length}]"));
    }
    let c = match rust {
        "u8" => "uint8_t",
        "u32" => "uint32_t",
        "i32" => "int32_t",
        "u64" => "uint64_t",
        "usize" => "size_t",
        "f64" => "double",
        "c_char" => "char",
        own if own.starts_with("sdg_") => own,
        unknown => panic!("expected a type that the header has, found {unknown}"),
    };
    format!("{c} {name}")
}

/// Converts documentation lines to a C comment, without the sections on `unsafe`.
fn comment(docs: &[&str], indent: &str) -> String {
    let lines: Vec<&str> =
        docs.iter().copied().take_while(|line| *line != "# Safety").filter(|line| !line.is_empty()).collect();
    format!("{indent}/* {} */\n", lines.join(&format!("\n{indent} * ")))
}

/// The declarations of a source file, in order.
fn declarations(source: &str) -> String {
    let mut header = String::new();
    let mut docs: Vec<&str> = Vec::new();
    let mut lines = source.lines();
    while let Some(line) = lines.next() {
        if let Some(doc) = line.strip_prefix("///") {
            docs.push(doc.trim());
            continue;
        }
        if line.starts_with("#[") {
            continue;
        }
        let declared = if let Some(constant) = line.strip_prefix("pub const ") {
            let (name, rest) = constant.split_once(": ").unwrap();
            let (of_type, value) = rest.strip_suffix(';').unwrap().split_once(" = ").unwrap();
            let suffix = if of_type == "u32" { "u" } else { "" };
            Some(format!("#define {name} {value}{suffix}\n"))
        } else if let Some(alias) = line.strip_prefix("pub type ") {
            let (name, of_type) = alias.strip_suffix(';').unwrap().split_once(" = ").unwrap();
            Some(format!("typedef {};\n", declaration(of_type, name)))
        } else if let Some(name) = line.strip_prefix("pub struct ").and_then(|rest| rest.strip_suffix(" {")) {
            Some(structure(name, &mut lines))
        } else if line.starts_with("pub ") && line.contains("extern \"C\" fn ") {
            let mut signature = line.to_owned();
            while !signature.ends_with('{') {
                signature += lines.next().unwrap().trim();
            }
            Some(function(&signature))
        } else {
            assert!(!line.starts_with("pub "), "expected constants, types, structures and functions, found {line}");
            None
        };
        if let Some(declared) = declared {
            _ = writeln!(header, "{}{declared}", comment(&docs, ""));
        }
        docs.clear();
    }
    header
}

fn structure<'a>(name: &str, lines: &mut impl Iterator<Item = &'a str>) -> String {
    let mut text = "typedef struct {\n".to_owned();
    let mut docs = Vec::new();
    for line in lines.map(str::trim).take_while(|line| *line != "}") {
        match line.strip_prefix("///") {
            Some(doc) => docs.push(doc.trim()),
            None => {
                let (field, of_type) =
                    line.strip_prefix("pub ").unwrap().trim_end_matches(',').split_once(": ").unwrap();
                _ = writeln!(text, "{}    {};", comment(&docs, "    "), declaration(of_type, field));
                docs.clear();
            }
        }
    }
    format!("{text}}} {name};\n")
}

fn function(signature: &str) -> String {
    let (_, rest) = signature.split_once("extern \"C\" fn ").unwrap();
    let (name, rest) = rest.split_once('(').unwrap();
    let (parameters, result) = rest.rsplit_once(") -> ").unwrap();
    let parameters: Vec<String> = parameters
        .split(',')
        .filter(|parameter| !parameter.trim().is_empty())
        .map(|parameter| {
            let (name, of_type) = parameter.trim().split_once(": ").unwrap();
            declaration(of_type, name)
        })
        .collect();
    let parameters = if parameters.is_empty() { "void".to_owned() } else { parameters.join(", ") };
    format!("{};\n", declaration(result.trim_end_matches(" {"), &format!("{name}({parameters})")))
}

const HEAD: &str = "\
/* sdg.h: grasps that were taught from one photo, found in pictures. docs/c.md is the guide.
 *
 * Generated from crates/capi/src by a test: change the sources, then run the test with SDG_WRITE_HEADER=1.
 *
 * Handles. Models, cameras and detections are numbers; each is freed once, with sdg_free, in any order. A handle that was freed, or
 * is of another kind of object, gives SDG_ERROR_HANDLE. Pointers must be NULL or point to memory as each function describes it.
 *
 * Threads. Every function may be called from any thread at any time, and handles may be shared. A detection uses one thread per core,
 * or sdg_options.threads. Detections that run at the same time share the threads unless they set a number. sdg_last_error is per
 * thread. A process that is forked after a model was loaded, or a detection or teaching was made, must call exec,
 * otherwise it gets SDG_ERROR_FORKED.
 *
 * Errors. Every function but sdg_abi_version and sdg_last_error returns SDG_OK or the kind of an error; results are written only
 * with SDG_OK. No exception is thrown, and no panic leaves the library.
 */
#ifndef SDG_H
#define SDG_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern \"C\" {
#endif

";
const TAIL: &str = "\
#ifdef __cplusplus
}
#endif

#endif
";

#[test]
fn the_header_says_what_the_library_exports() {
    let [types, functions] = [include_str!("types.rs"), include_str!("functions.rs")].map(declarations);
    let expected = format!("{HEAD}{types}{functions}{TAIL}");
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/include/sdg.h");
    if std::env::var_os("SDG_WRITE_HEADER").is_some() {
        std::fs::write(file, &expected).unwrap();
    }
    let found = std::fs::read_to_string(file).unwrap_or_default();
    let line = expected.lines().zip(found.lines()).find(|(expected, found)| expected != found);
    assert!(
        expected == found,
        "include/sdg.h differs from the sources, first at {line:?}: run this test with SDG_WRITE_HEADER=1"
    );
}

#[test]
fn every_exported_function_and_structure_is_declared() {
    let header = include_str!("../include/sdg.h");
    let sources = [include_str!("types.rs"), include_str!("functions.rs")].concat();
    let num_functions = sources.matches("#[unsafe(no_mangle)]").count();
    assert_eq!(header.matches("\nsdg_status sdg_").count() + 2, num_functions);
    assert_eq!(header.matches("typedef struct {").count(), sources.matches("#[repr(C)]").count());
    assert!(
        header.contains("\nsdg_status sdg_detections_get(sdg_handle detections, size_t idx, sdg_detection *found);\n")
    );
    assert!(header.contains("    char refused[128];\n"));
    assert_eq!(crate::SDG_REFUSED_BYTES, 128);
}

#[test]
#[should_panic(expected = "expected a type that the header has, found Vec<u8>")]
fn types_without_a_counterpart_are_refused() {
    declarations("/// No.\npub unsafe extern \"C\" fn sdg_no(list: Vec<u8>) -> sdg_status {\n");
}
