//! One connection to a robot or a hand: requests and responses over TCP, states over UDP.

use std::io::{ErrorKind, Read, Write};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, Shutdown, SocketAddr, TcpStream, UdpSocket};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TryRecvError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use crate::error::{FciError, Result};
use crate::message::read_message;
use crate::wire::{Header, HeaderKind};
use crate::wire_error::WireError;

/// Maximum number of received responses that are not yet processed; further ones wait in the network. A robot sends one
/// response for each request, and two for a Move.
const MAX_WAITING: usize = 16;
/// Maximum number of kept responses to requests for which no call waits yet; the oldest are dropped.
const MAX_KEPT: usize = 16;

/// The sending half of a connection, which any thread may use.
#[derive(Debug, Clone)]
pub(crate) struct Sending {
    address: SocketAddr,
    stream: Arc<Mutex<TcpStream>>,
    next_id: Arc<AtomicU32>,
}

impl Sending {
    /// Sends the message that `encode` creates for a new command number, and returns the number.
    pub(crate) fn send(&self, encode: impl FnOnce(u32) -> Vec<u8>) -> Result<u32> {
        let id = self.next_id.fetch_add(1, Ordering::Relaxed);
        let mut stream = self.stream.lock().unwrap_or_else(PoisonError::into_inner);
        stream.write_all(&encode(id)).map_err(|source| socket_error("send to", self.address, source))?;
        Ok(id)
    }
}

/// The output of the reading thread: a response, or the error that ended the thread.
type Incoming = std::result::Result<(Header, Vec<u8>), WireError>;

/// A connection, which is closed when it is dropped.
#[derive(Debug)]
pub(crate) struct Session {
    pub(crate) address: SocketAddr,
    pub(crate) sending: Sending,
    incoming: Receiver<Incoming>,
    kept: Vec<(Header, Vec<u8>)>,
    /// The invalid message that ended the connection.
    invalid: Option<WireError>,
    reader: Option<JoinHandle<()>>,
    udp: UdpSocket,
    udp_peer: Option<SocketAddr>,
    timeout: Duration,
}

impl Session {
    /// Connects to the first of a host's addresses that accepts the connection. `timeout` limits connecting, sending and
    /// each wait for a state; [`Self::wait_for`] has its own limit.
    pub(crate) fn connect(addresses: &[SocketAddr], kind: HeaderKind, timeout: Duration) -> Result<Self> {
        let (address, stream) = connect_first(addresses, timeout)?;
        let settings = || -> std::io::Result<(TcpStream, UdpSocket)> {
            stream.set_nodelay(true)?;
            stream.set_write_timeout(Some(timeout))?;
            let any: IpAddr =
                if address.is_ipv4() { Ipv4Addr::UNSPECIFIED.into() } else { Ipv6Addr::UNSPECIFIED.into() };
            let udp = UdpSocket::bind((any, 0))?;
            udp.set_read_timeout(Some(timeout))?;
            Ok((stream.try_clone()?, udp))
        };
        let (reading, udp) = settings().map_err(|source| socket_error("open sockets for", address, source))?;
        let (sender, incoming) = sync_channel(MAX_WAITING);
        let reader = thread::Builder::new()
            .name("fci responses".into())
            .spawn(move || read_responses(reading, kind, &sender))
            .map_err(|source| socket_error("start a thread for", address, source))?;
        Ok(Self {
            address,
            sending: Sending { address, stream: Arc::new(Mutex::new(stream)), next_id: Arc::new(AtomicU32::new(0)) },
            incoming,
            kept: Vec::new(),
            invalid: None,
            reader: Some(reader),
            udp,
            udp_peer: None,
            timeout,
        })
    }

    /// The UDP port to which the peer sends its states.
    pub(crate) fn udp_port(&self) -> Result<u16> {
        let local = self.udp.local_addr().map_err(|source| socket_error("open sockets for", self.address, source))?;
        Ok(local.port())
    }

    /// Waits for the response to a command, without a limit if `timeout` is `None`.
    pub(crate) fn wait_for(&mut self, id: u32, what: &'static str, timeout: Option<Duration>) -> Result<Vec<u8>> {
        let deadline = timeout.map(|timeout| Instant::now() + timeout);
        loop {
            if let Some(payload) = self.take_kept(id) {
                return Ok(payload);
            }
            let received = match deadline {
                None => self.incoming.recv().map_err(|_| RecvTimeoutError::Disconnected),
                Some(deadline) => self.incoming.recv_timeout(deadline.saturating_duration_since(Instant::now())),
            };
            match received {
                Ok(Ok(response)) => self.keep(response),
                Ok(Err(source)) => return Err(self.ended_by(source)),
                Err(RecvTimeoutError::Disconnected) => return Err(self.end()),
                Err(RecvTimeoutError::Timeout) => {
                    let waited = timeout.unwrap_or_default();
                    return Err(FciError::Timeout { what, address: self.address, waited });
                }
            }
        }
    }

    /// The timeout of this session, see [`Self::connect`].
    pub(crate) fn timeout(&self) -> Duration {
        self.timeout
    }

    /// The response to a command, if it has arrived, even if the connection ended after it.
    pub(crate) fn poll(&mut self, id: u32) -> Result<Option<Vec<u8>>> {
        let fetched = self.fetch();
        match self.take_kept(id) {
            Some(payload) => Ok(Some(payload)),
            None => fetched.map(|()| None),
        }
    }

    /// Drops responses for which no call waits.
    pub(crate) fn forget_responses(&mut self) {
        self.kept.clear();
    }

    /// Processes the received messages.
    ///
    /// # Errors
    /// [`FciError::Closed`] if the peer is disconnected, [`FciError::Wire`] for an invalid message.
    fn fetch(&mut self) -> Result<()> {
        loop {
            match self.incoming.try_recv() {
                Ok(Ok(response)) => self.keep(response),
                Ok(Err(source)) => return Err(self.ended_by(source)),
                Err(TryRecvError::Empty) => return Ok(()),
                Err(TryRecvError::Disconnected) => return Err(self.end()),
            }
        }
    }

    fn ended_by(&mut self, invalid: WireError) -> FciError {
        self.invalid = Some(invalid);
        self.end()
    }

    /// The error of the ended connection.
    fn end(&self) -> FciError {
        match self.invalid.clone() {
            Some(source) => FciError::Wire { address: self.address, source },
            None => FciError::Closed { address: self.address },
        }
    }

    fn keep(&mut self, response: (Header, Vec<u8>)) {
        if self.kept.len() == MAX_KEPT {
            self.kept.remove(0);
        }
        self.kept.push(response);
    }

    fn take_kept(&mut self, id: u32) -> Option<Vec<u8>> {
        let index = self.kept.iter().position(|(header, _)| header.command_id == id)?;
        Some(self.kept.remove(index).1)
    }

    /// Waits for a datagram of the peer and returns the newest one.
    ///
    /// `decode` converts a datagram to a state; if it rejects the newest datagram, its error is returned. If
    /// `discard_waiting` is set, datagrams received before the call are ignored.
    pub(crate) fn receive<T>(
        &mut self,
        size: usize,
        discard_waiting: bool,
        mut decode: impl FnMut(&[u8]) -> std::result::Result<T, WireError>,
    ) -> Result<T> {
        // One byte more than a state, to detect datagrams that are too long.
        let mut buffer = vec![0; size + 1];
        if discard_waiting {
            while self.receive_waiting(&mut buffer)?.is_some() {}
        }
        let deadline = Instant::now() + self.timeout;
        let mut newest = None;
        while newest.is_none() {
            match self.udp.recv_from(&mut buffer) {
                Ok((length, from)) => newest = self.accept(length, from),
                Err(error) if is_timeout(&error) => {}
                Err(source) => return Err(socket_error("receive from", self.address, source)),
            }
            if newest.is_none() && Instant::now() >= deadline {
                // If the robot has closed the connection, `fetch` returns the error.
                self.fetch()?;
                return Err(FciError::Timeout { what: "state", address: self.address, waited: self.timeout });
            }
        }
        let mut length = newest.unwrap_or_default();
        let mut state = decode(&buffer[..length]);
        while let Some(newer) = self.receive_waiting(&mut buffer)? {
            length = newer;
            state = decode(&buffer[..length]);
        }
        state.map_err(|source| FciError::Wire { address: self.address, source })
    }

    /// A datagram that has already arrived.
    fn receive_waiting(&mut self, buffer: &mut [u8]) -> Result<Option<usize>> {
        let address = self.address;
        let failed = |source| socket_error("receive from", address, source);
        self.udp.set_nonblocking(true).map_err(failed)?;
        let received = loop {
            match self.udp.recv_from(buffer) {
                Ok((length, from)) => {
                    if let Some(length) = self.accept(length, from) {
                        break Ok(Some(length));
                    }
                }
                Err(error) if is_timeout(&error) => break Ok(None),
                Err(source) => break Err(failed(source)),
            }
        };
        self.udp.set_nonblocking(false).map_err(failed)?;
        received
    }

    /// The length of a datagram, if it came from the peer.
    fn accept(&mut self, length: usize, from: SocketAddr) -> Option<usize> {
        if from.ip() != self.address.ip() {
            return None;
        }
        self.udp_peer = Some(from);
        Some(length)
    }

    /// Sends a datagram to the sender of the states.
    pub(crate) fn answer(&self, datagram: &[u8]) -> Result<()> {
        let peer = self.udp_peer.unwrap_or(self.address);
        self.udp.send_to(datagram, peer).map_err(|source| socket_error("send to", peer, source))?;
        Ok(())
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        let stream = self.sending.stream.lock().unwrap_or_else(PoisonError::into_inner);
        // An error means that the peer is already disconnected.
        let _ = stream.shutdown(Shutdown::Both);
        drop(stream);
        if let Some(reader) = self.reader.take() {
            // The reading thread may wait for room in the queue.
            while !reader.is_finished() {
                let _ = self.incoming.recv_timeout(Duration::from_millis(1));
            }
            let _ = reader.join();
        }
    }
}

/// Connects to the first address that accepts the connection, for example to the second one of `localhost` if the server
/// has no IPv6. Each address gets an equal share of the time left.
///
/// # Errors
/// The error of the last address.
fn connect_first(addresses: &[SocketAddr], timeout: Duration) -> Result<(SocketAddr, TcpStream)> {
    let deadline = Instant::now() + timeout;
    let source = ErrorKind::NotFound.into();
    let mut failed = FciError::Socket { action: "find", address: "an address".to_owned(), source };
    for (idx, &address) in addresses.iter().enumerate() {
        let left = deadline.saturating_duration_since(Instant::now()) / (addresses.len() - idx) as u32;
        // A wait of zero is not allowed.
        match TcpStream::connect_timeout(&address, left.max(Duration::from_millis(1))) {
            Ok(stream) => return Ok((address, stream)),
            Err(source) => failed = socket_error("connect to", address, source),
        }
    }
    Err(failed)
}

fn read_responses(mut stream: impl Read, kind: HeaderKind, sender: &SyncSender<Incoming>) {
    loop {
        match read_message(&mut stream, kind) {
            // An error of the socket counts as a closed connection.
            Err(_) => return,
            Ok(message) => {
                let is_end = message.is_err();
                if sender.send(message).is_err() || is_end {
                    return;
                }
            }
        }
    }
}

pub(crate) fn is_timeout(error: &std::io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted)
}

pub(crate) fn socket_error(action: &'static str, address: SocketAddr, source: std::io::Error) -> FciError {
    FciError::Socket { action, address: address.to_string(), source }
}

#[cfg(test)]
mod schedules;

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::TcpListener;

    #[test]
    fn the_first_address_that_accepts_the_connection_is_used() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let open = listener.local_addr().unwrap();
        // No program listens at these addresses of this computer.
        let [closed, last] = [2, 3].map(|host| SocketAddr::from(([127, 0, 0, host], open.port())));
        let (address, _stream) = connect_first(&[closed, open, last], Duration::from_secs(5)).unwrap();
        assert_eq!(address, open);
        let error = connect_first(&[closed, last], Duration::from_secs(5)).unwrap_err().to_string();
        assert!(error.contains(&last.to_string()), "{error}");
    }
}
