//! Kernels compiled a second time, for the processor's vector instructions.

/// The instruction set of this processor, detected once. Copy it into the tasks.
#[derive(Clone, Copy)]
pub struct Processor(pulp::Arch);

/// A loop that [`Processor::dispatch`] runs with the best vector instructions.
///
/// **Requires** `#[inline(always)]` on [`run`](Self::run) and on all that it calls: only what is inlined is compiled for
/// these instructions. Rust never fuses or reorders floating-point operations, so all processors give the same bits.
pub trait Kernel {
    /// Runs the loop.
    fn run(self);
}

struct Dispatched<K>(K);

impl<K: Kernel> pulp::WithSimd for Dispatched<K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        self.0.run();
    }
}

impl Processor {
    /// The processor that runs this.
    pub fn detect() -> Self {
        Self(pulp::Arch::new())
    }

    /// Runs a kernel.
    #[inline(always)]
    pub fn dispatch(self, kernel: impl Kernel) {
        self.0.dispatch(Dispatched(kernel));
    }
}
