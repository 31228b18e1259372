//! A disk whose power is cut: dm-flakey drops every write from a given moment on. Needs root and a block device whose
//! content may be lost.

use std::fs;
use std::io::{Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

/// Name of the mapped device.
const NAME: &str = "endurance";
/// ext4 syncs a file that replaces another one by its name; without this help a missing fsync is noticed. The journal
/// is committed every second instead of every five.
const OPTIONS: &str = "noauto_da_alloc,commit=1";

/// A block device with ext4, mounted.
#[derive(Debug)]
pub struct FlakeyDisk {
    device: PathBuf,
    sectors: u64,
    mount: PathBuf,
}

impl FlakeyDisk {
    /// Formats `device` and mounts it at the new folder `mount`.
    ///
    /// # Errors
    /// A device that cannot be mapped, formatted or mounted; missing rights.
    pub fn format(device: &Path, mount: &Path) -> Result<Self> {
        let bytes = fs::File::open(device)
            .and_then(|mut file| file.seek(SeekFrom::End(0)))
            .with_context(|| format!("{}: expected a block device", device.display()))?;
        fs::create_dir_all(mount)?;
        let disk = Self { device: device.to_owned(), sectors: bytes / 512, mount: mount.to_owned() };
        mapper(&["create", NAME, "--table", &disk.table(true)])?;
        run(Command::new("mkfs.ext4").args(["-q", "-F"]).arg(mapped()))?;
        disk.mount()?;
        Ok(disk)
    }

    /// The folder where the disk is mounted.
    pub fn folder(&self) -> &Path {
        &self.mount
    }

    /// Loses all writes that have not reached the disk yet, and mounts it again as after a restart.
    ///
    /// # Errors
    /// A disk that cannot be mounted again; a folder in use.
    pub fn cut_power(&self) -> Result<()> {
        self.load(false)?;
        run(Command::new("umount").arg(&self.mount))?;
        self.load(true)?;
        self.mount()
    }

    fn mount(&self) -> Result<()> {
        run(Command::new("mount").args(["-t", "ext4", "-o", OPTIONS]).arg(mapped()).arg(&self.mount))
    }

    fn table(&self, keeps_writes: bool) -> String {
        let (sectors, device) = (self.sectors, self.device.display());
        match keeps_writes {
            true => format!("0 {sectors} linear {device} 0"),
            // Zero seconds as usual, then one second without writes, repeated.
            false => format!("0 {sectors} flakey {device} 0 0 1 1 drop_writes"),
        }
    }

    /// Replaces the table without a sync of the file system.
    fn load(&self, keeps_writes: bool) -> Result<()> {
        mapper(&["suspend", "--nolockfs", "--noflush", NAME])?;
        mapper(&["load", NAME, "--table", &self.table(keeps_writes)])?;
        mapper(&["resume", NAME])
    }
}

impl Drop for FlakeyDisk {
    fn drop(&mut self) {
        let _ = run(Command::new("umount").arg(&self.mount));
        let _ = mapper(&["remove", NAME]);
    }
}

fn mapped() -> PathBuf {
    Path::new("/dev/mapper").join(NAME)
}

fn mapper(arguments: &[&str]) -> Result<()> {
    // The virtual machine has no udev, which would create the device's node.
    run(Command::new("dmsetup").args(arguments).env("DM_DISABLE_UDEV", "1"))
}

/// Runs a command that must succeed.
///
/// # Errors
/// A command that fails.
pub(crate) fn run(command: &mut Command) -> Result<()> {
    let status = command.status().with_context(|| command.get_program().display().to_string())?;
    ensure!(status.success(), "{command:?}: {status}; is this run as root?");
    Ok(())
}
