//! The asynchronous side of a command: the runtime, and the signals that end it.

use std::{future::Future, io};

use tokio::{
    runtime::{Builder, Runtime},
    select,
};

use crate::failure::Failure;

/// Runs `work` on one thread until it is done. A signal to stop ends it at once, and that is no failure.
pub(crate) fn once(work: impl Future<Output = Result<(), Failure>>) -> Result<(), Failure> {
    attended(async |mut stop| {
        select! {
            done = work => done,
            () = stop.wait() => Ok(()),
        }
    })
}

/// Runs `work`, which is handed the signals to stop, on one thread.
pub(crate) fn attended<F>(work: impl FnOnce(Stop) -> F) -> Result<(), Failure>
where
    F: Future<Output = Result<(), Failure>>,
{
    let runtime = build(&mut Builder::new_current_thread())?;
    let done = runtime.block_on(async { work(Stop::listen()?).await });
    // A host name that is still being looked up, or a question without an answer, must not hold the exit.
    runtime.shutdown_background();
    done
}

/// Runs `work`, which is handed the signals to stop, on all processors.
pub(crate) fn service<F>(work: impl FnOnce(Stop) -> F) -> Result<(), Failure>
where
    F: Future<Output = Result<(), Failure>>,
{
    let runtime = build(&mut Builder::new_multi_thread())?;
    let done = runtime.block_on(async { work(Stop::listen()?).await });
    runtime.shutdown_background();
    done
}

fn build(builder: &mut Builder) -> Result<Runtime, Failure> {
    builder.enable_all().build().map_err(|error| {
        Failure::Failed(format!("the runtime does not start: {error}; free memory, threads or file handles"))
    })
}

/// The signals to stop: Ctrl-C, and what a service manager sends.
pub(crate) struct Stop(signals::Signals);

impl Stop {
    fn listen() -> Result<Self, Failure> {
        signals::Signals::listen().map(Self).map_err(|error: io::Error| {
            Failure::Failed(format!("Ctrl-C cannot be caught: {error}; free file handles"))
        })
    }

    /// Returns when it is time to stop.
    pub(crate) async fn wait(&mut self) {
        self.0.wait().await;
    }
}

/// The signal to read the configuration again, where there is one.
pub(crate) struct Reloads(signals::Hangups);

impl Reloads {
    pub(crate) fn listen() -> Result<Self, Failure> {
        signals::Hangups::listen().map(Self).map_err(|error: io::Error| {
            Failure::Failed(format!("SIGHUP cannot be caught: {error}; free file handles"))
        })
    }

    /// Returns when the configuration is to be read again.
    pub(crate) async fn wait(&mut self) {
        self.0.wait().await;
    }
}

#[cfg(unix)]
mod signals {
    use std::io;

    use tokio::{
        select,
        signal::unix::{Signal, SignalKind, signal},
    };

    pub(super) struct Signals {
        interrupt: Signal,
        terminate: Signal,
    }

    impl Signals {
        pub(super) fn listen() -> io::Result<Self> {
            Ok(Self {
                interrupt: signal(SignalKind::interrupt())?,
                terminate: signal(SignalKind::terminate())?,
            })
        }

        pub(super) async fn wait(&mut self) {
            select! {
                _ = self.interrupt.recv() => {}
                _ = self.terminate.recv() => {}
            }
        }
    }

    pub(super) struct Hangups(Signal);

    impl Hangups {
        pub(super) fn listen() -> io::Result<Self> {
            signal(SignalKind::hangup()).map(Self)
        }

        pub(super) async fn wait(&mut self) {
            // It ends with the runtime only.
            if self.0.recv().await.is_none() {
                std::future::pending().await
            }
        }
    }
}

#[cfg(windows)]
mod signals {
    use std::io;

    use tokio::{
        select,
        signal::windows::{CtrlBreak, CtrlC, ctrl_break, ctrl_c},
    };

    pub(super) struct Signals {
        interrupt: CtrlC,
        terminate: CtrlBreak,
    }

    impl Signals {
        pub(super) fn listen() -> io::Result<Self> {
            Ok(Self { interrupt: ctrl_c()?, terminate: ctrl_break()? })
        }

        pub(super) async fn wait(&mut self) {
            select! {
                _ = self.interrupt.recv() => {}
                _ = self.terminate.recv() => {}
            }
        }
    }

    /// There is no such signal here.
    pub(super) struct Hangups;

    impl Hangups {
        pub(super) fn listen() -> io::Result<Self> {
            Ok(Self)
        }

        pub(super) async fn wait(&mut self) {
            std::future::pending().await
        }
    }
}
