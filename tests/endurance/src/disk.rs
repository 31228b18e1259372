//! A folder as a disk would hold it after a power cut: what was synced, and a seeded part of the rest.
//!
//! The rules are stricter than those of a journalled file system:
//! - a file's content is durable from its own fsync; content that changed since may be lost, cut, or end in zeros;
//! - names of a folder (create, rename, link, unlink) are durable from the folder's own fsync; of the changes since, any first part may
//!   be there, in the order in which they were made, each folder for itself.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use rand::Rng;

/// What a name of a folder stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Entry {
    Folder(u64),
    File(u64),
}

type Names = BTreeMap<OsString, Entry>;

/// The names of a folder since the start, and which of these states is on the disk.
#[derive(Debug)]
struct Folder {
    states: Vec<Names>,
    durable: usize,
}

/// A folder whose changes are followed.
#[derive(Debug)]
pub struct Disk {
    root: PathBuf,
    /// A second name of every file that was ever seen, on the same file system: its content stays readable, its inode is not used again.
    kept: PathBuf,
    root_inode: u64,
    folders: BTreeMap<u64, Folder>,
    /// The synced content of each file; none was synced of a file that is missing here.
    synced: BTreeMap<u64, Vec<u8>>,
}

/// How much was lost of what had not been synced.
#[derive(Debug, Clone, Copy, Default)]
pub struct Loss {
    /// Files whose content is not what the program wrote last.
    pub contents: usize,
    /// Folders whose names are not the last ones.
    pub folders: usize,
}

impl Disk {
    /// Begins to follow the folder `root`, all of which is durable now. `kept` is an empty folder on the same file system.
    ///
    /// # Errors
    /// A folder that cannot be read.
    pub fn follow(root: &Path, kept: &Path) -> Result<Self> {
        let root_inode = fs::metadata(root)?.ino();
        let (root, kept) = (root.to_owned(), kept.to_owned());
        let mut disk = Self { root, kept, root_inode, folders: BTreeMap::new(), synced: BTreeMap::new() };
        disk.look()?;
        for folder in disk.folders.values_mut() {
            folder.durable = folder.states.len() - 1;
        }
        let files: Vec<u64> = disk.folders.values().flat_map(|folder| files_of(&folder.states[0])).collect();
        for inode in files {
            disk.synced.insert(inode, fs::read(disk.kept_file(inode))?);
        }
        Ok(disk)
    }

    /// The folder that is followed.
    pub fn root(&self) -> &Path {
        &self.root
    }

    fn kept_file(&self, inode: u64) -> PathBuf {
        self.kept.join(inode.to_string())
    }

    /// Takes the names of all folders as they are now.
    ///
    /// # Errors
    /// A folder that cannot be read.
    pub fn look(&mut self) -> Result<()> {
        self.look_in(&self.root.clone(), self.root_inode)
    }

    fn look_in(&mut self, path: &Path, inode: u64) -> Result<()> {
        let mut names = Names::new();
        for entry in fs::read_dir(path).with_context(|| path.display().to_string())? {
            let entry = entry?;
            // Another thread of the program may have removed it since.
            let Ok(found) = entry.metadata() else { continue };
            let child = entry.path();
            if found.is_dir() {
                names.insert(entry.file_name(), Entry::Folder(found.ino()));
                self.look_in(&child, found.ino())?;
            } else {
                names.insert(entry.file_name(), Entry::File(found.ino()));
                let kept = self.kept_file(found.ino());
                if !kept.exists() {
                    let _ = fs::hard_link(&child, kept);
                }
            }
        }
        // A new folder is empty until its names are synced.
        let is_root = inode == self.root_inode;
        let first = || Folder { states: if is_root { vec![] } else { vec![Names::new()] }, durable: 0 };
        let folder = self.folders.entry(inode).or_insert_with(first);
        if folder.states.last() != Some(&names) {
            folder.states.push(names);
        }
        Ok(())
    }

    /// A file was synced with this content.
    pub fn file_synced(&mut self, inode: u64, content: Vec<u8>) {
        self.synced.insert(inode, content);
    }

    /// A folder was synced.
    pub fn folder_synced(&mut self, inode: u64) {
        if let Some(folder) = self.folders.get_mut(&inode) {
            folder.durable = folder.states.len() - 1;
        }
    }

    /// Writes the folder as it may be after a power cut now into the new folder `to`.
    ///
    /// # Errors
    /// Files that cannot be read or written.
    pub fn after_power_cut(&self, random: &mut impl Rng, to: &Path) -> Result<Loss> {
        let mut loss = Loss::default();
        self.write_folder(self.root_inode, random, to, &mut loss)?;
        Ok(loss)
    }

    fn write_folder(&self, inode: u64, random: &mut impl Rng, to: &Path, loss: &mut Loss) -> Result<()> {
        fs::create_dir(to).with_context(|| to.display().to_string())?;
        let folder = &self.folders[&inode];
        let last = folder.states.len() - 1;
        let state = random.random_range(folder.durable..=last);
        loss.folders += usize::from(state != last);
        for (name, entry) in &folder.states[state] {
            let path = to.join(name);
            match *entry {
                Entry::Folder(inode) => self.write_folder(inode, random, &path, loss)?,
                Entry::File(inode) => {
                    let kept = self.kept_file(inode);
                    let written = fs::read(&kept).with_context(|| kept.display().to_string())?;
                    let synced = self.synced.get(&inode).map_or(&[][..], Vec::as_slice);
                    let content = if written == synced { written.clone() } else { part_of(&written, synced, random) };
                    loss.contents += usize::from(content != written);
                    fs::write(&path, content)?;
                    fs::set_permissions(&path, fs::metadata(&kept)?.permissions())?;
                }
            }
        }
        Ok(())
    }
}

fn files_of(names: &Names) -> Vec<u64> {
    names.values().filter_map(|entry| if let Entry::File(inode) = entry { Some(*inode) } else { None }).collect()
}

/// What a disk may hold of content that was written over `synced` content, or after it, and not synced.
fn part_of(written: &[u8], synced: &[u8], random: &mut impl Rng) -> Vec<u8> {
    const BLOCK_BYTES: usize = 4096;
    match random.random_range(0..4) {
        0 => written.to_vec(),
        1 => synced.to_vec(),
        2 => written[..random.random_range(0..=written.len())].to_vec(),
        // The length was written, the last blocks were not.
        _ => {
            let blocks = random.random_range(0..=written.len() / BLOCK_BYTES) * BLOCK_BYTES;
            let mut content = written.to_vec();
            content[blocks..].fill(0);
            content
        }
    }
}
