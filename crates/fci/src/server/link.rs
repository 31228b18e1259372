//! The server's sockets, and the client that is connected to them.

use std::io::Write;
use std::net::{IpAddr, Shutdown, SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use crate::error::{FciError, Result};
use crate::message::read_message;
use crate::wire::{Header, HeaderKind};

/// Time within which a client must accept a response; a slower client counts as disconnected.
const WRITE_TIMEOUT: Duration = Duration::from_millis(100);
/// Maximum time for which a second client waits for the first one to disconnect: a client that has just disconnected
/// can therefore connect again at once. The time is shorter than a client's timeout for an answer (1 s).
const HANDOVER: Duration = Duration::from_millis(500);
/// Maximum number of events that wait for the loop; a client's further messages wait in the network.
const MAX_EVENTS: usize = 64;
/// Maximum number of datagrams read in one call, so that a flood of datagrams of other senders does not delay the loop.
const MAX_DATAGRAMS: usize = 64;
/// Time until the next attempt if no connection can be accepted, for example because no file descriptor is free.
const ACCEPT_PAUSE: Duration = Duration::from_millis(10);

/// Messages from the listening thread and the reading thread to the loop.
#[derive(Debug)]
enum LinkEvent {
    Connected(TcpStream, SocketAddr),
    Message(u64, Header, Vec<u8>),
    Gone(u64),
}

/// A message from the connection to the control loop.
#[derive(Debug)]
pub enum Incoming {
    /// A request of the client: header and body.
    Request(Header, Vec<u8>),
    /// The client has disconnected or sent an invalid message.
    Gone,
}

/// The connected client.
#[derive(Debug)]
struct Client {
    session: u64,
    stream: TcpStream,
    address: SocketAddr,
    udp_port: Option<u16>,
}

/// A client that connected while another was served.
#[derive(Debug)]
struct WaitingClient {
    stream: TcpStream,
    address: SocketAddr,
    until: Instant,
}

/// A TCP port with one client at a time, and its UDP socket.
#[derive(Debug)]
pub struct Link {
    kind: HeaderKind,
    address: SocketAddr,
    udp: UdpSocket,
    events: Receiver<LinkEvent>,
    sender: SyncSender<LinkEvent>,
    client: Option<Client>,
    waiting: Option<WaitingClient>,
    num_sessions: u64,
    is_stopping: Arc<AtomicBool>,
    listener: Option<JoinHandle<()>>,
}

impl Link {
    /// Listens on an address; UDP is sent from a separate port.
    ///
    /// # Errors
    /// [`FciError::Socket`], for example if the port is in use.
    pub fn listen(ip: IpAddr, port: u16, kind: HeaderKind) -> Result<Self> {
        let failed = |source| FciError::Socket { action: "listen on", address: format!("{ip}:{port}"), source };
        let listener = TcpListener::bind((ip, port)).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let udp = UdpSocket::bind((ip, 0)).map_err(failed)?;
        udp.set_nonblocking(true).map_err(failed)?;
        let (sender, events) = sync_channel(MAX_EVENTS);
        let is_stopping = Arc::new(AtomicBool::new(false));
        let accepted = (sender.clone(), is_stopping.clone());
        let thread = thread::Builder::new()
            .name("fci listener".into())
            .spawn(move || accept(&listener, &accepted.0, &accepted.1))
            .map_err(failed)?;
        Ok(Self {
            kind,
            address,
            udp,
            events,
            sender,
            client: None,
            waiting: None,
            num_sessions: 0,
            is_stopping,
            listener: Some(thread),
        })
    }

    /// The address for clients.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The next message of a client, without waiting.
    pub fn poll(&mut self) -> Option<Incoming> {
        loop {
            self.admit_waiting();
            match self.events.try_recv() {
                Ok(LinkEvent::Connected(stream, address)) => self.meet(stream, address),
                Ok(LinkEvent::Message(session, header, payload)) if self.is_of(session) => {
                    return Some(Incoming::Request(header, payload));
                }
                Ok(LinkEvent::Gone(session)) if self.is_of(session) => {
                    self.close();
                    return Some(Incoming::Gone);
                }
                // The event belongs to a client that is no longer served.
                Ok(LinkEvent::Message(..) | LinkEvent::Gone(..)) => {}
                Err(TryRecvError::Empty | TryRecvError::Disconnected) => return None,
            }
        }
    }

    /// Sends states to this port of the client from now on.
    pub fn open_udp(&mut self, port: u16) {
        if let Some(client) = &mut self.client {
            client.udp_port = Some(port);
        }
    }

    /// Whether a client has opened a session.
    pub fn is_open(&self) -> bool {
        self.client.as_ref().is_some_and(|client| client.udp_port.is_some())
    }

    /// Sends a response; a client that does not accept it counts as disconnected, which [`Link::poll`] reports.
    pub fn respond(&mut self, message: &[u8]) {
        if let Some(client) = &mut self.client
            && client.stream.write_all(message).is_err()
        {
            let _ = client.stream.shutdown(Shutdown::Both);
        }
    }

    /// Sends a state.
    pub fn send_state(&self, datagram: &[u8]) {
        if let Some(peer) = self.udp_peer() {
            // A datagram that cannot be sent counts as lost.
            let _ = self.udp.send_to(datagram, peer);
        }
    }

    /// Reads the client's next datagram into `buffer` and returns its length. Waits only after [`Link::set_waiting`].
    pub fn receive(&self, buffer: &mut [u8]) -> Option<usize> {
        let peer = self.udp_peer()?;
        for _ in 0..MAX_DATAGRAMS {
            match self.udp.recv_from(buffer) {
                Ok((length, from)) if from == peer => return Some(length),
                Ok(_) => {}
                // The error may belong to an earlier datagram (port unreachable); the next call continues to read.
                Err(_) => return None,
            }
        }
        None
    }

    /// Makes [`Link::receive`] wait for a datagram for a short time, or not at all.
    ///
    /// # Errors
    /// [`FciError::Socket`].
    pub fn set_waiting(&self, is_waiting: bool) -> Result<()> {
        let failed = |source| FciError::Socket { action: "set up", address: self.address.to_string(), source };
        self.udp.set_nonblocking(!is_waiting).map_err(failed)?;
        self.udp.set_read_timeout(Some(Duration::from_millis(2))).map_err(failed)
    }

    /// Ends the connection.
    pub fn close(&mut self) {
        if let Some(client) = self.client.take() {
            let _ = client.stream.shutdown(Shutdown::Both);
        }
    }

    fn udp_peer(&self) -> Option<SocketAddr> {
        let client = self.client.as_ref()?;
        Some(SocketAddr::new(client.address.ip(), client.udp_port?))
    }

    fn is_of(&self, session: u64) -> bool {
        self.client.as_ref().is_some_and(|client| client.session == session)
    }

    /// Accepts a client, or lets it wait if another is connected; a third client is refused.
    fn meet(&mut self, stream: TcpStream, address: SocketAddr) {
        if self.client.is_none() {
            self.take_client(stream, address);
        } else if self.waiting.is_none() {
            self.waiting = Some(WaitingClient { stream, address, until: Instant::now() + HANDOVER });
        } else {
            let _ = stream.shutdown(Shutdown::Both);
        }
    }

    /// Accepts the waiting client when the other client has disconnected, or refuses it after [`HANDOVER`].
    fn admit_waiting(&mut self) {
        let Some(waiting) = self.waiting.take() else { return };
        if self.client.is_none() {
            self.take_client(waiting.stream, waiting.address);
        } else if Instant::now() < waiting.until {
            self.waiting = Some(waiting);
        } else {
            let _ = waiting.stream.shutdown(Shutdown::Both);
        }
    }

    fn take_client(&mut self, stream: TcpStream, address: SocketAddr) {
        self.num_sessions += 1;
        let (session, kind, sender) = (self.num_sessions, self.kind, self.sender.clone());
        let set_up = || -> std::io::Result<TcpStream> {
            stream.set_nodelay(true)?;
            stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
            let reading = stream.try_clone()?;
            thread::Builder::new()
                .name("fci requests".into())
                .spawn(move || read_requests(reading, session, kind, &sender))?;
            Ok(stream)
        };
        if let Ok(stream) = set_up() {
            self.client = Some(Client { session, stream, address, udp_port: None });
        }
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.close();
        self.is_stopping.store(true, Ordering::Relaxed);
        // This connection wakes the thread that waits for clients.
        let _ = TcpStream::connect_timeout(&self.address, WRITE_TIMEOUT);
        if let Some(listener) = self.listener.take() {
            // The thread may wait until the queue has room for an event.
            while !listener.is_finished() {
                while self.events.try_recv().is_ok() {}
                thread::sleep(Duration::from_millis(1));
            }
            let _ = listener.join();
        }
    }
}

fn accept(listener: &TcpListener, sender: &SyncSender<LinkEvent>, is_stopping: &AtomicBool) {
    for stream in listener.incoming() {
        if is_stopping.load(Ordering::Relaxed) {
            return;
        }
        let Ok(stream) = stream else {
            thread::sleep(ACCEPT_PAUSE);
            continue;
        };
        let Ok(address) = stream.peer_addr() else { continue };
        if sender.send(LinkEvent::Connected(stream, address)).is_err() {
            return;
        }
    }
}

fn read_requests(mut stream: TcpStream, session: u64, kind: HeaderKind, sender: &SyncSender<LinkEvent>) {
    loop {
        let event = match read_message(&mut stream, kind) {
            Ok(Ok((header, payload))) => LinkEvent::Message(session, header, payload),
            // An invalid header ends the connection, like the end of the stream.
            Ok(Err(_)) | Err(_) => LinkEvent::Gone(session),
        };
        let is_end = matches!(event, LinkEvent::Gone(..));
        if sender.send(event).is_err() || is_end {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_client_that_floods_the_server_takes_no_memory() {
        const PAYLOAD: usize = 64 << 10;
        // 64 events and one that is being read are 4.3 MB; both sides of a connection hold some 6 MB.
        const MAX_TAKEN: usize = 32 << 20;
        let mut link = Link::listen([127, 0, 0, 1].into(), 0, HeaderKind::Robot).unwrap();
        let mut client = TcpStream::connect(link.address()).unwrap();
        client.set_write_timeout(Some(Duration::from_millis(300))).unwrap();
        let request = Header::message(HeaderKind::Robot, 0, 1, &[0; PAYLOAD]);
        client.write_all(&request).unwrap();
        let begin = Instant::now();
        while link.poll().is_none() {
            assert!(begin.elapsed() < Duration::from_secs(20), "no request arrived");
            thread::sleep(Duration::from_millis(1));
        }
        let mut num_sent = 0;
        while num_sent < 4 * MAX_TAKEN && client.write_all(&request).is_ok() {
            num_sent += request.len();
        }
        assert!(num_sent < MAX_TAKEN, "{num_sent} bytes of at most {MAX_TAKEN}");
    }
}
