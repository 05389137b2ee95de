use std::{
    ffi::OsString,
    io::Read,
    path::PathBuf,
    process::ChildStdout,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::JoinHandle,
};

use model::Image;

use crate::{
    Error, Limits, Probe, Programs, Result, Source, probe,
    process::Running,
    source::{self},
};

/// How frames are read.
#[derive(Debug, Clone)]
pub struct ReadOptions {
    /// width and height of the frames that come, pixels; `None` as in the file
    pub size: Option<[u32; 2]>,
    /// frames a second that come, by leaving out and doubling; `None` as in the file
    pub rate: Option<f64>,
    /// only every so-manieth frame of these, from the first
    pub every: u32,
    /// threads of the decoder
    pub threads: u32,
    /// what is accepted
    pub limits: Limits,
    /// where the programs are
    pub programs: Programs,
    /// reading ends with [`Error::Cancelled`] at the next frame once this is true
    pub cancelled: Option<Arc<AtomicBool>>,
}

impl Default for ReadOptions {
    /// Every frame as it is in the file.
    fn default() -> Self {
        Self {
            size: None,
            rate: None,
            every: 1,
            threads: 2,
            limits: Limits::default(),
            programs: Programs::default(),
            cancelled: None,
        }
    }
}

/// The frames of a video or of pictures, one after the other.
pub struct FrameReader {
    path: PathBuf,
    output: ChildStdout,
    running: Running,
    feeder: Option<JoinHandle<Result<()>>>,
    probe: Probe,
    size: [u32; 2],
    expected: Option<u64>,
    frames: u64,
    is_at_end: bool,
    limits: Limits,
    cancelled: Option<Arc<AtomicBool>>,
}

impl FrameReader {
    /// Looks into the file, checks the limits and starts to read.
    ///
    /// # Errors
    /// As [`probe`]; [`Error::Option`] for an invalid size or rate.
    pub fn open(source: &Source, options: &ReadOptions) -> Result<Self> {
        source.check()?;
        let mut probe = probe(source.path(), &options.programs, &options.limits)?;
        if let Source::Images { files, rate } = source {
            probe.rate = *rate;
            probe.num_frames = Some(files.len() as u64);
            probe.is_counted = true;
            probe.duration_secs = Some(files.len() as f64 / rate);
        }
        let size = options.size.unwrap_or(probe.size);
        check(&probe, size, source, options)?;

        let mut arguments: Vec<OsString> =
            ["-hide_banner", "-nostdin", "-v", "error", "-threads"].map(OsString::from).to_vec();
        arguments.push(options.threads.max(1).to_string().into());
        arguments.extend(Source::guards(options.limits.max_pixels));
        arguments.extend(source.input()?);
        let filters = filters(size, options);
        arguments.extend(
            ["-map", "0:v:0", "-an", "-sn", "-dn", "-vf", &filters, "-fps_mode", "passthrough"]
                .map(OsString::from),
        );
        arguments.extend(["-f", "rawvideo", "-pix_fmt", "rgb24", "pipe:1"].map(OsString::from));
        let files = match source {
            Source::Images { files, .. } => Some(files.clone()),
            Source::Video(_) => None,
        };
        let (running, pipes) = Running::start(&options.programs.ffmpeg, arguments, files.is_some())?;
        let feeder = files
            .zip(pipes.input)
            .map(|(files, input)| std::thread::spawn(move || source::feed(&files, input)));
        let frames = probe.num_frames.map(|frames| match options.rate {
            Some(rate) => (frames as f64 * rate / probe.rate).round() as u64,
            None => frames,
        });
        Ok(Self {
            path: source.path().into(),
            output: pipes.output,
            running,
            feeder,
            probe,
            size,
            expected: frames.map(|frames| frames.div_ceil(u64::from(options.every.max(1)))),
            frames: 0,
            is_at_end: false,
            limits: options.limits,
            cancelled: options.cancelled.clone(),
        })
    }

    /// What is in the file.
    pub fn probe(&self) -> &Probe {
        &self.probe
    }

    /// Width and height of the frames that come, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// How many frames will come, as far as the file tells.
    pub fn expected_frames(&self) -> Option<u64> {
        self.expected
    }

    /// Frames that came.
    pub fn frames_read(&self) -> u64 {
        self.frames
    }

    /// A black frame to be read into.
    pub fn frame(&self) -> Image {
        Image::black(self.size[0] as usize, self.size[1] as usize)
    }

    /// Reads the next frame into `frame`; false at the end, when `frame` holds nothing of use.
    ///
    /// # Errors
    /// [`Error::FrameSize`] if `frame` is of another size than [`size`](Self::size), [`Error::Cancelled`],
    /// [`Error::TooLong`], [`Error::CutOff`], [`Error::NotAVideo`].
    pub fn read(&mut self, frame: &mut Image) -> Result<bool> {
        let [width, height] = self.size.map(|side| side as usize);
        if (frame.width(), frame.height()) != (width, height) {
            return Err(Error::FrameSize {
                found_width: frame.width(),
                found_height: frame.height(),
                width,
                height,
            });
        }
        if self.cancelled.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed)) {
            return Err(Error::Cancelled { frames: self.frames });
        }
        if self.is_at_end {
            return Ok(false);
        }
        let bytes = frame.rgb_mut();
        let mut filled = 0;
        while filled < bytes.len() {
            match self.output.read(&mut bytes[filled..]) {
                Ok(0) => break,
                Ok(count) => filled += count,
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                Err(e) => return Err(self.running.failed(e)),
            }
        }
        if filled < bytes.len() {
            self.is_at_end = true;
            self.end(filled > 0)?;
            return Ok(false);
        }
        self.frames += 1;
        if self.frames > self.limits.max_frames {
            let (path, limit) = (self.path.clone(), self.limits.max_frames);
            return Err(Error::TooLong { path, found: self.frames, limit });
        }
        Ok(true)
    }

    /// Judges the end: ffmpeg reads what it can of a damaged file and only complains.
    fn end(&mut self, is_partial: bool) -> Result<()> {
        let (status, message) = self.running.wait()?;
        if let Some(feeder) = self.feeder.take() {
            // a thread that writes files can't panic
            feeder.join().unwrap_or(Ok(()))?;
        }
        let (path, found) = (self.path.clone(), self.frames);
        if found == 0 {
            return Err(Error::NotAVideo { path, message });
        }
        let is_short = self.expected.is_some_and(|expected| found < expected) && !message.is_empty();
        if is_partial || is_short || !status.success() {
            let expected = self.expected.map_or_else(|| "more".into(), |count| count.to_string());
            return Err(Error::CutOff { path, found, expected, message });
        }
        Ok(())
    }
}

fn check(probe: &Probe, [width, height]: [u32; 2], source: &Source, options: &ReadOptions) -> Result<()> {
    let path = || source.path().into();
    let limits = &options.limits;
    if width == 0 || height == 0 {
        let what = format!("frames of {width} x {height} pixels were asked for, expected at least 1 x 1");
        return Err(Error::Option { what });
    }
    if u64::from(width) * u64::from(height) > limits.max_pixels {
        return Err(Error::TooLarge { path: path(), width, height, limit: limits.max_pixels });
    }
    if let Some(rate) = options.rate.filter(|rate| !(*rate >= 1e-3 && *rate <= 1e4)) {
        let what = format!("{rate} frames a second were asked for, expected 0.001 to 10000");
        return Err(Error::Option { what });
    }
    match probe.num_frames {
        Some(found) if found > limits.max_frames => {
            Err(Error::TooLong { path: path(), found, limit: limits.max_frames })
        }
        _ => Ok(()),
    }
}

fn filters([width, height]: [u32; 2], options: &ReadOptions) -> String {
    let mut filters = Vec::new();
    filters.extend(options.rate.map(|rate| format!("fps={rate}")));
    if options.every > 1 {
        filters.push(format!("select=not(mod(n\\,{}))", options.every));
    }
    // the same bits on every processor
    filters.push(format!("scale={width}:{height}:flags=bicubic+accurate_rnd+full_chroma_int+bitexact"));
    filters.join(",")
}
