//! JSON in the styles of various programs: keys in any order, indented or not, escapes, a byte order mark, line ends.

use rand::Rng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64Mcg;
use serde_json::Value;

/// The bytes of the file, and a description of the style.
pub fn written(dice: &mut Pcg64Mcg, value: &Value) -> (Vec<u8>, String) {
    let [is_shuffled, is_indented, is_ascii, has_mark, has_crlf] =
        [0.6, 0.5, 0.4, 0.3, 0.3].map(|p| dice.random_bool(p));
    let mut text = String::new();
    let mut writer = Writer { dice, is_shuffled, is_indented, is_ascii };
    writer.append(&mut text, value, 0);
    text.push('\n');
    if has_crlf {
        text = text.replace('\n', "\r\n");
    }
    let mark: &[u8] = if has_mark { b"\xef\xbb\xbf" } else { b"" };
    let recipe = format!(
        "JSON with keys shuffled {is_shuffled}, indented {is_indented}, ASCII {is_ascii}, byte order mark {has_mark}, CRLF {has_crlf}"
    );
    ([mark, text.as_bytes()].concat(), recipe)
}

struct Writer<'a> {
    dice: &'a mut Pcg64Mcg,
    is_shuffled: bool,
    is_indented: bool,
    is_ascii: bool,
}

impl Writer<'_> {
    fn append(&mut self, text: &mut String, value: &Value, depth: usize) {
        match value {
            Value::Object(fields) => {
                let mut keys: Vec<&String> = fields.keys().collect();
                if self.is_shuffled {
                    keys.shuffle(self.dice);
                }
                text.push('{');
                for (idx, key) in keys.into_iter().enumerate() {
                    self.separate(text, idx, depth);
                    self.append_text(text, key);
                    text.push_str(if self.is_indented { ": " } else { ":" });
                    self.append(text, &fields[key], depth + 1);
                }
                text.push('}');
            }
            Value::Array(items) => {
                text.push('[');
                for (idx, item) in items.iter().enumerate() {
                    self.separate(text, idx, depth);
                    self.append(text, item, depth + 1);
                }
                text.push(']');
            }
            Value::String(string) => self.append_text(text, string),
            other => *text += &other.to_string(),
        }
    }

    fn separate(&self, text: &mut String, idx: usize, depth: usize) {
        if idx > 0 {
            text.push(',');
        }
        if self.is_indented {
            text.push('\n');
            text.extend(std::iter::repeat_n("\t", depth + 1));
        }
    }

    fn append_text(&self, text: &mut String, string: &str) {
        let quoted = Value::from(string).to_string();
        for character in quoted.chars() {
            if self.is_ascii && !character.is_ascii() {
                let mut units = [0; 2];
                character.encode_utf16(&mut units).iter().for_each(|unit| *text += &format!("\\u{unit:04x}"));
            } else {
                text.push(character);
            }
        }
    }
}
