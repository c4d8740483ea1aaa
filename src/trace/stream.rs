//! Kernels one after the other, submitted when a result is needed, timed by stage.

use std::collections::BTreeMap;

use crate::Result;
use crate::vulkan::{Buffer, Gpu, Pipeline, Recorder};

/// Label of the spans between stages.
const BETWEEN: &str = "";

/// A sequence of dispatches, each after all before it. Nothing runs before [`Stream::finish`].
pub struct Stream<'g> {
    gpu: &'g Gpu,
    recorder: Option<Recorder>,
    seconds: BTreeMap<String, f64>,
    counts: bool,
    invocations: Option<u64>,
}

impl<'g> Stream<'g> {
    /// An empty stream.
    pub fn new(gpu: &'g Gpu) -> Stream<'g> {
        Stream { gpu, recorder: None, seconds: BTreeMap::new(), counts: false, invocations: None }
    }

    /// The same, with invocations of kernels counted by the driver.
    pub fn counting(gpu: &'g Gpu) -> Stream<'g> {
        Stream { counts: true, ..Stream::new(gpu) }
    }

    /// The device.
    pub fn gpu(&self) -> &'g Gpu {
        self.gpu
    }

    fn recorder(&mut self, stage: &str) -> Result<&mut Recorder> {
        if self.recorder.is_none() {
            let mut recorder = self.gpu.recorder(stage)?;
            if self.counts {
                recorder.count_invocations()?;
            }
            self.recorder = Some(recorder);
        }
        Ok(self.recorder.as_mut().unwrap_or_else(|| unreachable!("just made")))
    }

    /// Runs one invocation of `pipeline` for each of `count` items. `reached` are the buffers that the
    /// kernel reads by address.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn dispatch(
        &mut self,
        stage: &str,
        pipeline: &Pipeline,
        (buffers, reached): (&[&Buffer], &[&Buffer]),
        push: &impl bytemuck::NoUninit,
        count: u32,
    ) -> Result<()> {
        let groups = count.div_ceil(pipeline.kernel().interface().local_size);
        self.timed(stage, reached, |recorder| recorder.dispatch(pipeline, buffers, bytemuck::bytes_of(push), groups))
    }

    /// As [`Stream::dispatch`], with the number of workgroups read from a buffer at a byte offset.
    ///
    /// # Errors
    /// As [`Recorder::dispatch_indirect`].
    pub fn dispatch_indirect(
        &mut self,
        stage: &str,
        pipeline: &Pipeline,
        (buffers, reached): (&[&Buffer], &[&Buffer]),
        push: &impl bytemuck::NoUninit,
        (groups, offset): (&Buffer, u64),
    ) -> Result<()> {
        self.timed(stage, reached, |recorder| {
            recorder.dispatch_indirect(pipeline, buffers, bytemuck::bytes_of(push), groups, offset)
        })
    }

    /// Records a dispatch between timestamps, and a barrier after it.
    fn timed(
        &mut self,
        stage: &str,
        reached: &[&Buffer],
        dispatch: impl FnOnce(&mut Recorder) -> Result<()>,
    ) -> Result<()> {
        let recorder = self.recorder(stage)?;
        recorder.timestamp(stage)?;
        dispatch(recorder)?;
        recorder.timestamp(BETWEEN)?;
        recorder.barrier();
        reached.iter().for_each(|buffer| recorder.keep(buffer));
        Ok(())
    }

    /// Sets every word of `buffer` to `value`.
    ///
    /// # Errors
    /// As [`Recorder::fill`].
    pub fn fill(&mut self, buffer: &Buffer, value: u32) -> Result<()> {
        let recorder = self.recorder("fill")?;
        recorder.fill(buffer, value)?;
        recorder.barrier();
        Ok(())
    }

    /// Submits what was recorded and waits for it.
    ///
    /// # Errors
    /// [`crate::Error::Device`] naming the first stage of the submission if the device fails.
    pub fn finish(&mut self) -> Result<()> {
        let Some(recorder) = self.recorder.take() else { return Ok(()) };
        let timings = recorder.submit()?;
        if let Some(more) = timings.invocations {
            *self.invocations.get_or_insert(0) += more;
        }
        for span in timings.spans {
            if span.label != BETWEEN {
                *self.seconds.entry(span.label).or_default() += span.seconds;
            }
        }
        Ok(())
    }

    /// Invocations of kernels so far, if they are counted and the device can.
    pub fn invocations(&self) -> Option<u64> {
        self.invocations
    }

    /// Seconds on the device by stage since the last call.
    pub fn take_seconds(&mut self) -> BTreeMap<String, f64> {
        std::mem::take(&mut self.seconds)
    }
}
