//! Runs a program under ptrace, follows its changes in a folder, and kills it at a given change.
//!
//! A seccomp filter stops the program only at the system calls that can change or sync files. It also catches calls
//! that a library makes without the C library, so no library has to be preloaded.

use std::fs;
use std::io;
use std::os::unix::fs::{FileExt, MetadataExt};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};

use anyhow::{Context, Result, bail, ensure};
use libc::{c_int, c_long, pid_t, sock_filter};

use crate::disk::Disk;

/// The calls without paths that stop the program.
const WRITES: [c_long; 10] = [
    libc::SYS_write,
    libc::SYS_pwrite64,
    libc::SYS_writev,
    libc::SYS_pwritev,
    libc::SYS_ftruncate,
    libc::SYS_fallocate,
    libc::SYS_fsync,
    libc::SYS_fdatasync,
    libc::SYS_copy_file_range,
    libc::SYS_sendfile,
];
/// Positions of path arguments: the argument with the folder's descriptor, if any, and the argument with the path.
type PathArguments = &'static [(Option<usize>, usize)];
/// The calls with paths that stop the program, and their path arguments.
const NAMES: [(c_long, PathArguments); 16] = [
    (libc::SYS_open, &[(None, 0)]),
    (libc::SYS_creat, &[(None, 0)]),
    (libc::SYS_openat, &[(Some(0), 1)]),
    (libc::SYS_truncate, &[(None, 0)]),
    (libc::SYS_rename, &[(None, 0), (None, 1)]),
    (libc::SYS_renameat, &[(Some(0), 1), (Some(2), 3)]),
    (libc::SYS_renameat2, &[(Some(0), 1), (Some(2), 3)]),
    (libc::SYS_unlink, &[(None, 0)]),
    (libc::SYS_unlinkat, &[(Some(0), 1)]),
    (libc::SYS_link, &[(None, 0), (None, 1)]),
    (libc::SYS_linkat, &[(Some(0), 1), (Some(2), 3)]),
    (libc::SYS_symlink, &[(None, 1)]),
    (libc::SYS_symlinkat, &[(Some(1), 2)]),
    (libc::SYS_mkdir, &[(None, 0)]),
    (libc::SYS_mkdirat, &[(Some(0), 1)]),
    (libc::SYS_rmdir, &[(None, 0)]),
];

/// How the program ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// Killed before the requested change.
    Killed,
    /// Ended by itself, with this exit code.
    Exited(i32),
    /// Ended by another signal.
    Signalled(i32),
}

/// A started program. Only the thread that started it can trace it.
#[derive(Debug)]
pub struct Tracee {
    /// The process; its pipes may be taken.
    pub child: Child,
}

impl Tracee {
    /// Starts a program; it runs to its first call in the filter and waits there for [`Tracee::follow`].
    ///
    /// # Errors
    /// A program that cannot be started or traced.
    pub fn start(command: &mut Command) -> Result<Self> {
        let filter = filter();
        // SAFETY: only system calls between fork and exec; `filter` was allocated before.
        unsafe {
            command.pre_exec(move || {
                let program = libc::sock_fprog { len: filter.len() as u16, filter: filter.as_ptr().cast_mut().cast() };
                let refused = libc::ptrace(libc::PTRACE_TRACEME, 0, 0, 0) != 0
                    || libc::prctl(libc::PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0
                    || libc::prctl(libc::PR_SET_SECCOMP, libc::SECCOMP_MODE_FILTER, &program, 0, 0) != 0;
                if refused { Err(io::Error::last_os_error()) } else { Ok(()) }
            });
        }
        let child = command.spawn().with_context(|| format!("{}: cannot trace", command.get_program().display()))?;
        let pid = child.id() as pid_t;
        let (stopped, status) = wait(pid)?.context("expected the program to stop at its start")?;
        ensure!(stopped == pid && libc::WIFSTOPPED(status), "expected the program to stop at its start");
        let options = libc::PTRACE_O_TRACESECCOMP
            | libc::PTRACE_O_TRACECLONE
            | libc::PTRACE_O_TRACEFORK
            | libc::PTRACE_O_TRACEVFORK
            | libc::PTRACE_O_TRACESYSGOOD
            | libc::PTRACE_O_EXITKILL;
        request(libc::PTRACE_SETOPTIONS as c_long, pid, options as c_long)?;
        request(libc::PTRACE_CONT as c_long, pid, 0)?;
        Ok(Self { child })
    }

    /// Follows the program to its end, or kills it before its change number `kill_at` (from 1). Also returns the number
    /// of changes that it began.
    ///
    /// # Errors
    /// Errors of ptrace and of the folder.
    pub fn follow(self, disk: &mut Disk, kill_at: Option<u64>) -> Result<(Ending, u64)> {
        let main = self.child.id() as pid_t;
        let (mut changes, mut ending) = (0, None);
        // The loop ends when the program has no threads left.
        while let Some((tid, status)) = wait(-1)? {
            if libc::WIFEXITED(status) || libc::WIFSIGNALED(status) {
                if tid == main && ending.is_none() {
                    let by_itself = libc::WIFEXITED(status);
                    ending = Some(if by_itself {
                        Ending::Exited(libc::WEXITSTATUS(status))
                    } else {
                        Ending::Signalled(libc::WTERMSIG(status))
                    });
                }
                continue;
            }
            if ending == Some(Ending::Killed) {
                // The processes that the program started are killed before they make another change.
                kill(tid);
                continue;
            }
            let (signal, event) = (libc::WSTOPSIG(status), status >> 16);
            // A thread that was killed in the meantime answers no request.
            let step = if event == libc::PTRACE_EVENT_SECCOMP {
                let Ok(call) = Call::of(tid) else { continue };
                if call.changes(disk.root()) {
                    changes += 1;
                    if kill_at == Some(changes) {
                        [main, tid].into_iter().for_each(kill);
                        ending = Some(Ending::Killed);
                        continue;
                    }
                }
                if call.is_followed() { libc::PTRACE_SYSCALL } else { libc::PTRACE_CONT }
            } else {
                if signal == libc::SIGTRAP | 0x80
                    && let Ok(call) = Call::of(tid)
                {
                    call.done(disk)?;
                }
                libc::PTRACE_CONT
            };
            // These stops belong to ptrace; a new thread begins with SIGSTOP. Other signals are passed on.
            let is_ours = event != 0 || [libc::SIGTRAP, libc::SIGTRAP | 0x80, libc::SIGSTOP].contains(&signal);
            let _ = request(step as c_long, tid, if is_ours { 0 } else { c_long::from(signal) });
        }
        match ending {
            Some(ending) => Ok((ending, changes)),
            None => bail!("expected the end of the program, found no process to wait for"),
        }
    }
}

/// The next stop or end of a process of this thread; `None` if there is none left.
fn wait(pid: pid_t) -> Result<Option<(pid_t, c_int)>> {
    let mut status = 0;
    // SAFETY: `status` outlives the call.
    let found = unsafe { libc::waitpid(pid, &mut status, libc::__WALL | libc::__WNOTHREAD) };
    if found < 0 {
        let error = io::Error::last_os_error();
        return if error.raw_os_error() == Some(libc::ECHILD) { Ok(None) } else { Err(error.into()) };
    }
    Ok(Some((found, status)))
}

fn kill(pid: pid_t) {
    // SAFETY: no memory is involved. The process was not reaped yet, so the number is still its own.
    unsafe { libc::kill(pid, libc::SIGKILL) };
}

fn request(request: c_long, tid: pid_t, data: c_long) -> io::Result<()> {
    // SAFETY: the requests of this file take only numbers.
    let answer = unsafe { libc::ptrace(request as libc::c_uint, tid, 0, data) };
    if answer < 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
}

/// A filter that stops at the calls of the tables and allows all others.
fn filter() -> Vec<sock_filter> {
    const X86_64: u32 = 0xC000_003E;
    let instruction = |code: u32, jt: u8, jf: u8, k: u32| sock_filter { code: code as u16, jt, jf, k };
    let load = |offset| instruction(libc::BPF_LD | libc::BPF_W | libc::BPF_ABS, 0, 0, offset);
    let equals =
        |value: u32, jt: usize, jf: u8| instruction(libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K, jt as u8, jf, value);
    let answer = |value| instruction(libc::BPF_RET | libc::BPF_K, 0, 0, value);
    let calls: Vec<c_long> = WRITES.into_iter().chain(NAMES.map(|(call, _)| call)).collect();
    let mut program = vec![load(4), equals(X86_64, 1, 0), answer(libc::SECCOMP_RET_ALLOW), load(0)];
    let count = calls.len();
    program.extend(calls.iter().enumerate().map(|(idx, call)| equals(*call as u32, count - idx, 0)));
    program.extend([answer(libc::SECCOMP_RET_ALLOW), answer(libc::SECCOMP_RET_TRACE)]);
    program
}

/// The system call at which a thread is stopped.
struct Call {
    tid: pid_t,
    number: c_long,
    arguments: [u64; 6],
    answer: i64,
}

impl Call {
    fn of(tid: pid_t) -> io::Result<Self> {
        // SAFETY: plain numbers, for which zeros are valid.
        let mut found: libc::user_regs_struct = unsafe { std::mem::zeroed() };
        // SAFETY: the structure is the one that this request fills.
        let answer = unsafe { libc::ptrace(libc::PTRACE_GETREGS, tid, 0, &mut found) };
        if answer < 0 {
            return Err(io::Error::last_os_error());
        }
        let arguments = [found.rdi, found.rsi, found.rdx, found.r10, found.r8, found.r9];
        Ok(Self { tid, number: found.orig_rax as c_long, arguments, answer: found.rax as i64 })
    }

    /// The descriptor that is written or synced: of `copy_file_range` the second one, of the other calls the first.
    fn descriptor(&self) -> Option<PathBuf> {
        let argument = match self.number {
            libc::SYS_copy_file_range => 2,
            number if WRITES.contains(&number) => 0,
            _ => return None,
        };
        Some(PathBuf::from(format!("/proc/{}/fd/{}", self.tid, self.arguments[argument] as i32)))
    }

    fn flags(&self) -> i32 {
        match self.number {
            libc::SYS_open => self.arguments[1] as i32,
            libc::SYS_openat => self.arguments[2] as i32,
            _ => libc::O_CREAT,
        }
    }

    /// Whether the call changes or syncs something under `root`.
    fn changes(&self, root: &Path) -> bool {
        if let Some(descriptor) = self.descriptor() {
            return fs::read_link(descriptor).is_ok_and(|path| path.starts_with(root));
        }
        if self.flags() & (libc::O_CREAT | libc::O_TRUNC) == 0 {
            return false;
        }
        let paths = NAMES.iter().find(|(number, _)| *number == self.number).map_or(&[][..], |(_, paths)| *paths);
        paths.iter().any(|(folder, path)| self.path(*folder, *path).is_some_and(|path| path.starts_with(root)))
    }

    fn path(&self, folder: Option<usize>, argument: usize) -> Option<PathBuf> {
        let memory = fs::File::open(format!("/proc/{}/mem", self.tid)).ok()?;
        let mut bytes = vec![0; libc::PATH_MAX as usize];
        let length = memory.read_at(&mut bytes, self.arguments[argument]).ok()?;
        let end = bytes[..length].iter().position(|byte| *byte == 0)?;
        let path = PathBuf::from(String::from_utf8_lossy(&bytes[..end]).into_owned());
        let folder = match folder.map(|argument| self.arguments[argument] as i32) {
            None | Some(libc::AT_FDCWD) => format!("/proc/{}/cwd", self.tid),
            Some(descriptor) => format!("/proc/{}/fd/{descriptor}", self.tid),
        };
        Some(if path.is_absolute() { path } else { fs::read_link(folder).ok()?.join(path) })
    }

    /// Whether the call must be followed to its end: names may have changed, or something was synced.
    fn is_followed(&self) -> bool {
        match self.number {
            libc::SYS_fsync | libc::SYS_fdatasync => true,
            number if WRITES.contains(&number) => false,
            _ => self.flags() & libc::O_CREAT != 0,
        }
    }

    /// Updates the disk after a call that was followed to its end.
    fn done(&self, disk: &mut Disk) -> Result<()> {
        if self.answer < 0 {
            return Ok(());
        }
        if ![libc::SYS_fsync, libc::SYS_fdatasync].contains(&self.number) {
            return disk.look();
        }
        let Some(descriptor) = self.descriptor() else { return Ok(()) };
        if !fs::read_link(&descriptor).is_ok_and(|path| path.starts_with(disk.root())) {
            return Ok(());
        }
        let found = fs::metadata(&descriptor)?;
        if found.is_dir() {
            disk.folder_synced(found.ino());
        } else {
            disk.file_synced(found.ino(), fs::read(&descriptor)?);
        }
        Ok(())
    }
}
