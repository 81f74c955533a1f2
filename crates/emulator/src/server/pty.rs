//! A pseudo-terminal in place of a serial port: programs open its path as they would open `/dev/ttyUSB0`.

#[cfg(target_os = "linux")]
pub(super) use imp::Pty;

#[cfg(target_os = "linux")]
mod imp {
    use std::io;
    use std::os::fd::OwnedFd;

    use busbar_link::Serial;
    use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
    use rustix::io::Errno;
    use rustix::pty::{OpenptFlags, grantpt, ioctl_tiocgptpeer, openpt, ptsname, unlockpt};
    use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
    use tokio::io::unix::AsyncFd;

    /// The far end of a new pseudo-terminal.
    #[derive(Debug)]
    pub(in super::super) struct Pty {
        far: AsyncFd<OwnedFd>,
        /// Open as long as we are, so that clients may come and go.
        _near: OwnedFd,
        path: String,
    }

    impl Pty {
        pub(in super::super) fn open(serial: &Serial) -> io::Result<Self> {
            let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
            let far = openpt(flags)?;
            grantpt(&far)?;
            unlockpt(&far)?;
            let near = ioctl_tiocgptpeer(&far, flags)?;
            let mut termios = tcgetattr(&near)?;
            termios.make_raw();
            // For whoever looks; no byte is faster or slower for it.
            let _ = termios.set_speed(serial.baud);
            tcsetattr(&near, OptionalActions::Now, &termios)?;
            fcntl_setfl(&far, fcntl_getfl(&far)? | OFlags::NONBLOCK)?;
            let path = ptsname(&far, Vec::new())?.to_string_lossy().into_owned();
            #[expect(deprecated, reason = "its successor is unsafe; an OwnedFd stays the same file")]
            let far = AsyncFd::new(far)?;
            Ok(Self { far, _near: near, path })
        }

        /// What clients open.
        pub(in super::super) fn path(&self) -> &str {
            &self.path
        }

        pub(in super::super) async fn read(&self, buffer: &mut [u8]) -> io::Result<usize> {
            loop {
                let mut ready = self.far.readable().await?;
                match rustix::io::read(self.far.get_ref(), &mut *buffer) {
                    Err(Errno::AGAIN) => ready.clear_ready(),
                    Err(Errno::INTR) => {}
                    other => return Ok(other?),
                }
            }
        }

        /// Writes what there is room for. A line waits for nobody: the rest is lost, as it is where nobody listens.
        pub(in super::super) fn write(&self, bytes: &[u8]) {
            let _ = rustix::io::write(self.far.get_ref(), bytes);
        }
    }
}
