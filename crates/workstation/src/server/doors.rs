//! The door: a connection that has not shown the key stays for a moment only, and never crowds out
//! one that has.
//!
//! The port is loopback, which all accounts of a machine share, and a process has some thousand
//! descriptors at most: whoever opens connections and says nothing would lock the owner out.

use axum::extract::connect_info::Connected;
use axum::serve::{IncomingStream, Listener};
use std::collections::VecDeque;
use std::future::Future as _;
use std::io::{self, IoSlice};
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::task::{Context, Poll, Waker};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::time::{Instant, Sleep, sleep};

/// So many connections may be without the key at a time; a page's files come over six. The oldest
/// makes room for the next.
const MOST: usize = 64;
/// So long a connection may be without it and take nothing: the page's files may come by a slow
/// tunnel.
const WITHIN: Duration = Duration::from_secs(5);
/// Between two tries to accept a connection while there are no descriptors.
const AGAIN: Duration = Duration::from_millis(50);

/// Who is at the other end of a connection.
#[derive(Clone, Debug)]
pub(crate) struct Guest(Arc<Standing>);

#[derive(Debug, Default)]
struct Standing {
    known: AtomicBool,
    sent_away: AtomicBool,
    waker: Mutex<Option<Waker>>,
}

impl Guest {
    /// The key was shown: the connection may stay.
    pub(crate) fn let_in(&self) {
        self.0.known.store(true, Ordering::SeqCst);
    }
}

impl Standing {
    fn send_away(&self) {
        self.sent_away.store(true, Ordering::SeqCst);
        let waker = self.waker.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(waker) = waker {
            waker.wake();
        }
    }
}

impl Connected<IncomingStream<'_, Doors>> for Guest {
    fn connect_info(stream: IncomingStream<'_, Doors>) -> Self {
        stream.remote_addr().clone()
    }
}

/// A listener with a door.
pub(crate) struct Doors {
    listener: TcpListener,
    /// Without the key so far, the oldest first.
    strangers: VecDeque<Weak<Standing>>,
}

impl Doors {
    pub(crate) fn new(listener: TcpListener) -> Self {
        Self { listener, strangers: VecDeque::new() }
    }

    /// Sends the oldest strangers away until there are fewer than `most`.
    fn make_room(&mut self, most: usize) {
        let waits = |one: &Weak<Standing>| {
            one.upgrade().is_some_and(|one| !one.known.load(Ordering::SeqCst))
        };
        self.strangers.retain(waits);
        while self.strangers.len() >= most {
            if let Some(oldest) = self.strangers.pop_front().and_then(|one| one.upgrade()) {
                oldest.send_away();
            }
        }
    }
}

impl Listener for Doors {
    type Io = Connection;
    type Addr = Guest;

    async fn accept(&mut self) -> (Connection, Guest) {
        loop {
            match self.listener.accept().await {
                Ok((stream, _)) => {
                    self.make_room(MOST);
                    let standing = Arc::<Standing>::default();
                    self.strangers.push_back(Arc::downgrade(&standing));
                    let guest = Guest(standing);
                    let deadline = Box::pin(sleep(WITHIN));
                    return (Connection { stream, guest: guest.clone(), deadline }, guest);
                }
                // No descriptors, or a connection that was gone before it was accepted.
                Err(_) => {
                    self.make_room(MOST / 2);
                    sleep(AGAIN).await;
                }
            }
        }
    }

    fn local_addr(&self) -> io::Result<Guest> {
        self.listener.local_addr().map(|_: SocketAddr| Guest(Arc::default()))
    }
}

/// A connection that ends when the key is not shown in time, or others want its place.
pub(crate) struct Connection {
    stream: TcpStream,
    guest: Guest,
    deadline: Pin<Box<Sleep>>,
}

impl Connection {
    /// An error once a stranger has to go.
    fn stays(&mut self, cx: &mut Context<'_>) -> io::Result<()> {
        let standing = &self.guest.0;
        if standing.known.load(Ordering::SeqCst) {
            return Ok(());
        }
        *standing.waker.lock().unwrap_or_else(PoisonError::into_inner) = Some(cx.waker().clone());
        let late = self.deadline.as_mut().poll(cx).is_ready();
        if late || standing.sent_away.load(Ordering::SeqCst) {
            return Err(io::Error::new(io::ErrorKind::ConnectionAborted, "no key was shown"));
        }
        Ok(())
    }

    /// Whoever takes what is sent may go on.
    fn took(&mut self, taken: Poll<io::Result<usize>>) -> Poll<io::Result<usize>> {
        let took_some = matches!(taken, Poll::Ready(Ok(n)) if n > 0);
        if took_some && !self.guest.0.known.load(Ordering::SeqCst) {
            self.deadline.as_mut().reset(Instant::now() + WITHIN);
        }
        taken
    }
}

impl AsyncRead for Connection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        self.stays(cx)?;
        Pin::new(&mut self.stream).poll_read(cx, buffer)
    }
}

impl AsyncWrite for Connection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        self.stays(cx)?;
        let taken = Pin::new(&mut self.stream).poll_write(cx, bytes);
        self.took(taken)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        parts: &[IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        self.stays(cx)?;
        let taken = Pin::new(&mut self.stream).poll_write_vectored(cx, parts);
        self.took(taken)
    }

    /// Else every volume that is sent is copied once more.
    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.stays(cx)?;
        Pin::new(&mut self.stream).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }
}
