//! All orders of up to five steps of the reading thread and of a caller of [`Session`], compared with a model without
//! threads. The two share only a channel, so that their steps do not overlap.

use std::net::{TcpListener, TcpStream, UdpSocket};
use std::sync::atomic::AtomicU32;
use std::sync::mpsc::sync_channel;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::{Incoming, MAX_WAITING, Sending, Session};
use crate::error::FciError;
use crate::wire::Header;
use crate::wire_error::WireError;

/// Maximum number of steps: there are 6 + 36 + … + 6⁵ = 9330 schedules.
const MAX_TURNS: u32 = 5;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Turn {
    /// The response to this request arrives.
    Respond(u32),
    /// The caller asks for the response to this request.
    Poll(u32),
    /// The caller waits for it, at most until it has read what has arrived.
    Wait(u32),
}

const TURNS: [Turn; 6] =
    [Turn::Respond(0), Turn::Respond(1), Turn::Poll(0), Turn::Poll(1), Turn::Wait(0), Turn::Wait(1)];

/// The end of the connection.
#[derive(Debug, Clone, Copy, PartialEq)]
enum End {
    Closed,
    Invalid,
}

/// The specification of [`Session`]: responses by request, in the order of their arrival.
#[derive(Default)]
struct Model(Vec<(u32, u8)>);

impl Model {
    fn take(&mut self, id: u32) -> Option<Vec<u8>> {
        let idx = self.0.iter().position(|(of, _)| *of == id)?;
        Some(vec![self.0.remove(idx).1])
    }
}

/// Sockets that the sessions of all schedules share; nothing is sent.
struct Sockets(TcpStream, UdpSocket);

impl Sockets {
    fn open() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let stream = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        Self(stream, UdpSocket::bind("127.0.0.1:0").unwrap())
    }

    /// A session whose reading thread is the other end of the channel.
    fn session(&self, incoming: std::sync::mpsc::Receiver<Incoming>) -> Session {
        let address = self.1.local_addr().unwrap();
        let stream = Arc::new(Mutex::new(self.0.try_clone().unwrap()));
        Session {
            address,
            sending: Sending { address, stream, next_id: Arc::new(AtomicU32::new(0)) },
            incoming,
            kept: Vec::new(),
            invalid: None,
            reader: None,
            udp: self.1.try_clone().unwrap(),
            udp_peer: None,
            timeout: Duration::ZERO,
        }
    }
}

fn check(sockets: &Sockets, schedule: &[Turn], end: End) {
    let (sender, incoming) = sync_channel(MAX_WAITING);
    let mut session = sockets.session(incoming);
    let mut model = Model::default();
    for (step, turn) in (0..).zip(schedule) {
        match *turn {
            Turn::Respond(id) => {
                sender.send(Ok((Header { command: 0, command_id: id, size: 13 }, vec![step]))).unwrap();
                model.0.push((id, step));
            }
            Turn::Poll(id) => assert_eq!(session.poll(id).unwrap(), model.take(id), "{schedule:?}"),
            Turn::Wait(id) => {
                let found = session.wait_for(id, "test", Some(Duration::ZERO));
                match model.take(id) {
                    Some(expected) => assert_eq!(found.unwrap(), expected, "{schedule:?}"),
                    None => assert!(matches!(found, Err(FciError::Timeout { .. })), "{schedule:?}"),
                }
            }
        }
    }
    let invalid = WireError::Value { field: "test", found: 7 };
    if end == End::Invalid {
        sender.send(Err(invalid.clone())).unwrap();
    }
    drop(sender);
    // The responses before the end are delivered, then each call returns the reason of the end.
    for id in [0, 1] {
        while let Some(expected) = model.take(id) {
            assert_eq!(session.poll(id).unwrap(), Some(expected), "{schedule:?}, {end:?}");
        }
        for found in [session.poll(id).map(drop), session.wait_for(id, "test", None).map(drop)] {
            match (end, found.unwrap_err()) {
                (End::Closed, FciError::Closed { .. }) => {}
                (End::Invalid, FciError::Wire { source, .. }) => assert_eq!(source, invalid),
                (_, other) => panic!("{schedule:?}, {end:?}: {other}"),
            }
        }
    }
}

#[test]
fn every_schedule_delivers_each_response_once_and_then_the_end() {
    let sockets = Sockets::open();
    let mut num_schedules = 0;
    for length in 1..=MAX_TURNS {
        for number in 0..6_usize.pow(length) {
            let turns = (0..length).map(|place| TURNS[number / 6_usize.pow(place) % 6]);
            let schedule: Vec<Turn> = turns.collect();
            check(&sockets, &schedule, End::Closed);
            check(&sockets, &schedule, End::Invalid);
            num_schedules += 1;
        }
    }
    assert_eq!(num_schedules, 9330);
}
