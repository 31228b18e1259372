//! The stack machine of pickles.

use std::collections::HashMap;

use crate::error::{Result, WeightsError, printable};
use crate::source::{Scanner, Source, Span};
use crate::tensor::{Encoding, Payload};

use super::construct;
use super::global::Global;
use super::object::{Arena, Object, Pickle, Text, Value};

/// Maximum number of operations; a ResNet-50 detector with its optimiser's state has about 30 000. Limits memory and
/// time: an operation adds at most about 200 bytes, besides copies from the file.
const MAX_OPERATIONS: u32 = 400_000;
/// Maximum length of a name, in bytes.
const LONGEST_NAME: u64 = 1024;
/// Maximum number of arguments of an allowed function.
const MAX_ARGUMENTS: usize = 16;

/// Runs the pickle at the start of `span`.
///
/// # Errors
/// A global that weights do not need; a file that is not a pickle of protocol 2 to 5, or is truncated or altered.
pub(crate) fn load(source: &mut Source, span: Span) -> Result<Pickle> {
    let mut machine = Machine {
        scanner: Scanner::new(source, span)?,
        at: span.offset,
        stack: Vec::new(),
        marks: Vec::new(),
        memo: HashMap::new(),
        arena: Arena::default(),
        operations: 0,
    };
    let (start, protocol) = (span.offset, machine.scanner.take::<2>()?);
    if protocol[0] != 0x80 || !(2..=5).contains(&protocol[1]) {
        let found = format!("bytes {protocol:02x?}");
        return Err(WeightsError::damaged(format!("byte {start}"), "a pickle of protocol 2 to 5", found));
    }
    while !machine.step()? {}
    let root = machine.pop()?;
    Ok(Pickle { arena: machine.arena, root, end: machine.scanner.position() })
}

struct Machine<'a> {
    scanner: Scanner<'a>,
    /// The position of the current operation in the file.
    at: u64,
    stack: Vec<Value>,
    /// Heights of the stack at the open marks.
    marks: Vec<usize>,
    memo: HashMap<u32, Value>,
    arena: Arena,
    operations: u32,
}

impl Machine<'_> {
    /// Executes one operation; returns true at the end of the pickle.
    fn step(&mut self) -> Result<bool> {
        self.charge(1)?;
        self.at = self.scanner.position();
        let opcode = self.scanner.byte()?;
        match opcode {
            // STOP
            b'.' => return Ok(true),
            // PROTO, FRAME: not used by the machine.
            0x80 => self.scanner.skip(1).map(drop)?,
            0x95 => self.scanner.skip(8).map(drop)?,
            b'(' => self.marks.push(self.stack.len()),
            b'0' => self.pop().map(drop)?,
            b'1' => self.pop_mark().map(drop)?,
            // DUP
            b'2' => {
                let top = self.top()?;
                self.stack.push(top);
            }
            b'N' => self.stack.push(Value::None),
            0x88 => self.stack.push(Value::Bool(true)),
            0x89 => self.stack.push(Value::Bool(false)),
            b'J' | b'K' | b'M' | b'G' | 0x8a | 0x8b => self.number(opcode)?,
            b'X' | 0x8c | 0x8d | b'T' | b'U' | b'B' | b'C' | 0x8e | 0x96 => self.string(opcode)?,
            b')' | 0x85..=0x87 | b't' | b']' | b'l' | 0x8f | 0x91 | b'}' | b'd' => self.make_container(opcode)?,
            b'a' | b'e' | 0x90 | b's' | b'u' => self.add_to_container(opcode)?,
            b'q' | b'r' | 0x94 => self.memoize(opcode)?,
            b'h' | b'j' => self.recall(opcode)?,
            b'c' | 0x93 => self.global(opcode)?,
            // REDUCE, NEWOBJ: a class or function and its arguments.
            b'R' | 0x81 => {
                let arguments = self.pop()?;
                let callable = self.pop()?;
                let made = self.call(callable, arguments)?;
                self.stack.push(made);
            }
            // BUILD
            b'b' => {
                let state = self.pop()?;
                let object = self.top()?;
                construct::set_state(&mut self.arena, object, state, self.at)?;
            }
            // BINPERSID
            b'Q' => {
                let id = self.pop()?;
                let storage = construct::storage(&mut self.arena, id, self.at)?;
                self.stack.push(storage);
            }
            other => return Err(self.damaged("an operation that weights need", format!("{other:#04x}"))),
        }
        Ok(false)
    }

    fn damaged(&self, expected: &str, found: impl Into<String>) -> WeightsError {
        WeightsError::damaged(format!("pickle, byte {}", self.at), expected, found)
    }

    /// Counts operations; each copied item counts as an operation.
    fn charge(&mut self, count: usize) -> Result<()> {
        let total = u64::from(self.operations) + count as u64;
        if total > u64::from(MAX_OPERATIONS) {
            let what = "operations of a pickle".to_owned();
            return Err(WeightsError::TooLarge { what, most: u64::from(MAX_OPERATIONS), found: total });
        }
        self.operations = total as u32;
        Ok(())
    }

    /// Height of the stack at the last mark.
    fn floor(&self) -> usize {
        self.marks.last().copied().unwrap_or(0)
    }

    fn top(&self) -> Result<Value> {
        match self.stack.last() {
            Some(value) if self.stack.len() > self.floor() => Ok(*value),
            _ => Err(self.damaged("a value on the stack", "none")),
        }
    }

    fn pop(&mut self) -> Result<Value> {
        let top = self.top()?;
        self.stack.pop();
        Ok(top)
    }

    /// Removes the last mark and everything above it, which is returned.
    fn pop_mark(&mut self) -> Result<Vec<Value>> {
        match self.marks.pop() {
            Some(mark) => Ok(self.stack.split_off(mark)),
            None => Err(self.damaged("a mark on the stack", "none")),
        }
    }

    fn push(&mut self, object: Object) {
        let value = self.arena.add(object);
        self.stack.push(value);
    }

    fn number(&mut self, opcode: u8) -> Result<()> {
        let scanner = &mut self.scanner;
        let value = match opcode {
            b'J' => Value::Int(i64::from(i32::from_le_bytes(scanner.take()?))),
            b'K' => Value::Int(i64::from(scanner.byte()?)),
            b'M' => Value::Int(i64::from(u16::from_le_bytes(scanner.take()?))),
            b'G' => scanner.skip(8).map(|_| Value::OtherNumber)?,
            // LONG1, LONG4: two's complement of a given length.
            _ => {
                let len = match opcode {
                    0x8a => u64::from(scanner.byte()?),
                    _ => u64::from(u32::from_le_bytes(scanner.take()?)),
                };
                if len <= 8 {
                    let mut bytes = [0; 8];
                    scanner.fill(&mut bytes[..len as usize])?;
                    let negative = len > 0 && bytes[len as usize - 1] >= 0x80;
                    let sign = if negative { 0xff } else { 0 };
                    bytes[len as usize..].fill(sign);
                    Value::Int(i64::from_le_bytes(bytes))
                } else {
                    scanner.skip(len).map(|_| Value::OtherNumber)?
                }
            }
        };
        self.stack.push(value);
        Ok(())
    }

    /// Text, Python 2 strings and bytes: short text is read; of all others only the position is stored.
    fn string(&mut self, opcode: u8) -> Result<()> {
        let scanner = &mut self.scanner;
        let len = match opcode {
            0x8c | b'U' | b'C' => u64::from(scanner.byte()?),
            b'X' | b'T' | b'B' => u64::from(u32::from_le_bytes(scanner.take()?)),
            _ => u64::from_le_bytes(scanner.take()?),
        };
        let start = scanner.position();
        let is_text = matches!(opcode, b'X' | 0x8c | 0x8d | b'T' | b'U');
        if !is_text || len > LONGEST_NAME {
            let span = scanner.skip(len)?;
            let encoding = if is_text && !matches!(opcode, b'T' | b'U') { Encoding::Latin1 } else { Encoding::Raw };
            self.push(match is_text {
                true => Object::Text(Box::new(Text { span, encoding, short: None })),
                false => Object::Bytes(Payload { span, encoding }),
            });
            return Ok(());
        }
        let mut bytes = vec![0; len as usize];
        scanner.fill(&mut bytes)?;
        let span = Span { offset: start, len };
        let text = if matches!(opcode, b'T' | b'U') {
            let short: String = bytes.iter().map(|&byte| char::from(byte)).collect();
            Text { span, encoding: Encoding::Raw, short: Some(short.into()) }
        } else {
            let short = String::from_utf8(bytes).map_err(|_| self.damaged("text in UTF-8", "other bytes"))?;
            Text { span, encoding: Encoding::Latin1, short: Some(short.into()) }
        };
        self.push(Object::Text(Box::new(text)));
        Ok(())
    }

    fn make_container(&mut self, opcode: u8) -> Result<()> {
        let object = match opcode {
            b')' | b']' | 0x8f => Object::Sequence(Vec::new()),
            b'}' => Object::Dict(Vec::new()),
            0x85..=0x87 => {
                let count = usize::from(opcode - 0x84);
                let mut items = vec![Value::None; count];
                for item in items.iter_mut().rev() {
                    *item = self.pop()?;
                }
                Object::Sequence(items)
            }
            b'd' => {
                let items = self.pop_mark()?;
                Object::Dict(self.pairs(&items)?)
            }
            _ => Object::Sequence(self.pop_mark()?),
        };
        self.push(object);
        Ok(())
    }

    fn pairs(&self, items: &[Value]) -> Result<Vec<(Value, Value)>> {
        let (pairs, rest) = items.as_chunks::<2>();
        if !rest.is_empty() {
            return Err(self.damaged("keys and values in turn", format!("{} items", items.len())));
        }
        Ok(pairs.iter().map(|[key, value]| (*key, *value)).collect())
    }

    fn add_to_container(&mut self, opcode: u8) -> Result<()> {
        let items = match opcode {
            b'a' => vec![self.pop()?],
            b's' => {
                let value = self.pop()?;
                vec![self.pop()?, value]
            }
            _ => self.pop_mark()?,
        };
        let container = self.top()?;
        if matches!(opcode, b's' | b'u') {
            let pairs = self.pairs(&items)?;
            if let Some(Object::Dict(entries)) = self.arena.object_mut(container) {
                entries.extend(pairs);
                return Ok(());
            }
            return Err(self.damaged("a dict to add to", self.arena.describe(container)));
        }
        if let Some(Object::Sequence(list)) = self.arena.object_mut(container) {
            list.extend(items);
            return Ok(());
        }
        Err(self.damaged("a list to add to", self.arena.describe(container)))
    }

    fn memoize(&mut self, opcode: u8) -> Result<()> {
        let idx = match opcode {
            b'q' => u32::from(self.scanner.byte()?),
            b'r' => u32::from_le_bytes(self.scanner.take()?),
            // MEMOIZE stores at the next free index.
            _ => self.memo.len() as u32,
        };
        let top = self.top()?;
        self.memo.insert(idx, top);
        Ok(())
    }

    fn recall(&mut self, opcode: u8) -> Result<()> {
        let idx = match opcode {
            b'h' => u32::from(self.scanner.byte()?),
            _ => u32::from_le_bytes(self.scanner.take()?),
        };
        let value = self.memo.get(&idx).copied();
        self.stack.push(value.ok_or_else(|| self.damaged("a remembered value", format!("none at {idx}")))?);
        Ok(())
    }

    fn global(&mut self, opcode: u8) -> Result<()> {
        let (module, name) = match opcode {
            b'c' => (self.line()?, self.line()?),
            _ => {
                let (name, module) = (self.pop()?, self.pop()?);
                match (self.arena.text(module), self.arena.text(name)) {
                    (Some(module), Some(name)) => (module.to_owned(), name.to_owned()),
                    _ => return Err(self.damaged("module and name of a global", self.arena.describe(name))),
                }
            }
        };
        let Some(global) = Global::resolve(&module, &name) else {
            let name = printable(&format!("{module}.{name}"));
            return Err(WeightsError::ForbiddenGlobal { name, offset: self.at });
        };
        self.stack.push(Value::Global(global));
        Ok(())
    }

    /// Text up to a line feed.
    fn line(&mut self) -> Result<String> {
        let mut bytes = Vec::new();
        while bytes.len() as u64 <= LONGEST_NAME {
            match self.scanner.byte()? {
                b'\n' => return String::from_utf8(bytes).map_err(|_| self.damaged("a name in UTF-8", "other bytes")),
                byte => bytes.push(byte),
            }
        }
        Err(self.damaged("a name", "a line without end"))
    }

    fn call(&mut self, callable: Value, arguments: Value) -> Result<Value> {
        let Value::Global(global) = callable else {
            return Err(self.damaged("a class or function to call", self.arena.describe(callable)));
        };
        let Some(items) = self.arena.sequence(arguments) else {
            return Err(self.damaged("a tuple of arguments", self.arena.describe(arguments)));
        };
        if items.len() > MAX_ARGUMENTS {
            return Err(self.damaged("a few arguments", format!("{}", items.len())));
        }
        let items = items.to_vec();
        // A dict made from a list copies the list.
        if let Some(list) = items.first().and_then(|first| self.arena.sequence(*first)) {
            self.charge(list.len())?;
        }
        construct::call(&mut self.arena, global, &items, self.at)
    }
}
