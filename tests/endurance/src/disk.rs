//! A folder as a disk would hold it after a power cut: the synced content, and a random part of the rest, by seed.
//!
//! The rules are stricter than those of a journalled file system:
//! - The content of a file is durable after the file's own fsync; content that changed since then may be lost,
//!   truncated, or end in zeros.
//! - The names in a folder (create, rename, link, unlink) are durable after the folder's own fsync; of the changes
//!   since then, any number of the first ones may be on the disk, independently for each folder.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use rand::Rng;

/// The file or folder of a name, by inode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Entry {
    Folder(u64),
    File(u64),
}

type Names = BTreeMap<OsString, Entry>;

/// All states of the names in a folder since the start, and the index of the state that is durable.
#[derive(Debug)]
struct Folder {
    states: Vec<Names>,
    durable: usize,
}

/// A folder whose changes are recorded.
#[derive(Debug)]
pub struct Disk {
    root: PathBuf,
    /// A folder on the same file system with a hard link to every file that was ever seen, so that its content stays
    /// readable and its inode is not reused.
    kept: PathBuf,
    root_inode: u64,
    folders: BTreeMap<u64, Folder>,
    /// The synced content of each file; a missing file was never synced.
    synced: BTreeMap<u64, Vec<u8>>,
}

/// The amount of unsynced data that a power cut lost.
#[derive(Debug, Clone, Copy, Default)]
pub struct Loss {
    /// Number of files whose content is not the last one that the program wrote.
    pub contents: usize,
    /// Number of folders whose names are not the last ones.
    pub folders: usize,
}

impl Disk {
    /// Starts to record the folder `root`, whose content now is durable. `kept` is an empty folder on the same file
    /// system.
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

    /// The recorded folder.
    pub fn root(&self) -> &Path {
        &self.root
    }

    fn kept_file(&self, inode: u64) -> PathBuf {
        self.kept.join(inode.to_string())
    }

    /// Records the current names of all folders.
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
            // Another thread of the program may have removed the file in the meantime.
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
        // The durable state of a new folder is empty until the folder is synced.
        let is_root = inode == self.root_inode;
        let first = || Folder { states: if is_root { vec![] } else { vec![Names::new()] }, durable: 0 };
        let folder = self.folders.entry(inode).or_insert_with(first);
        if folder.states.last() != Some(&names) {
            folder.states.push(names);
        }
        Ok(())
    }

    /// Records that a file was synced with this content.
    pub fn file_synced(&mut self, inode: u64, content: Vec<u8>) {
        self.synced.insert(inode, content);
    }

    /// Records that a folder was synced.
    pub fn folder_synced(&mut self, inode: u64) {
        if let Some(folder) = self.folders.get_mut(&inode) {
            folder.durable = folder.states.len() - 1;
        }
    }

    /// Writes the folder, as it may be after a power cut now, into the new folder `to`.
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

/// A random state, on the disk, of a file with the durable content `synced` and the later, unsynced content `written`.
fn part_of(written: &[u8], synced: &[u8], random: &mut impl Rng) -> Vec<u8> {
    const BLOCK_BYTES: usize = 4096;
    match random.random_range(0..4) {
        0 => written.to_vec(),
        1 => synced.to_vec(),
        2 => written[..random.random_range(0..=written.len())].to_vec(),
        // The length reached the disk, but the last blocks did not.
        _ => {
            let blocks = random.random_range(0..=written.len() / BLOCK_BYTES) * BLOCK_BYTES;
            let mut content = written.to_vec();
            content[blocks..].fill(0);
            content
        }
    }
}
