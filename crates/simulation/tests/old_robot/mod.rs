//! A server that answers the Connect of one client with version 4 of the protocol, as old Pandas do.

use std::io::Write;
use std::net::{SocketAddr, TcpListener};
use std::thread::{self, JoinHandle};

use sdg_fci::read_message;
use sdg_fci::wire::{Header, HeaderKind};

/// Starts the robot; returns its address, and the thread that ends after the answer.
pub fn serve() -> (SocketAddr, JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let answering = thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let (header, _) = read_message(&mut stream, HeaderKind::Robot).unwrap().unwrap();
        stream.write_all(&Header::message(HeaderKind::Robot, 0, header.command_id, &[1, 4, 0])).unwrap();
    });
    (address, answering)
}
