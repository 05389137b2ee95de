use std::{
    ffi::OsString,
    fs,
    io::{Read, Write},
    path::PathBuf,
    process::ChildStdin,
};

use model::Image;

use crate::{Error, Programs, Result, process::Running, source::as_file};

/// How frames are written.
#[derive(Debug, Clone, PartialEq)]
pub struct WriteOptions {
    /// frames a second
    pub rate: f64,
    /// 0 (best) to 51 (smallest), as x264 counts
    pub quality: u32,
    /// where the programs are
    pub programs: Programs,
}

impl Default for WriteOptions {
    fn default() -> Self {
        Self { rate: 30.0, quality: 20, programs: Programs::default() }
    }
}

/// Writes an MP4: H.264 where ffmpeg has libx264, else MPEG-4; pixel format yuv420p. The file is whole once
/// [`finish`](Self::finish) has returned; without that it is removed.
pub struct FrameWriter {
    path: PathBuf,
    size: [u32; 2],
    input: Option<ChildStdin>,
    running: Running,
    frames: u64,
    is_finished: bool,
}

impl FrameWriter {
    /// Starts to write frames of `size` (width and height, pixels) into a new file, or over an old one.
    ///
    /// # Errors
    /// [`Error::Option`] for an invalid size or rate, [`Error::ProgramMissing`].
    pub fn create(path: impl Into<PathBuf>, size: [u32; 2], options: &WriteOptions) -> Result<Self> {
        let path = path.into();
        if size.iter().any(|side| !(1..=16384).contains(side)) {
            let what = format!("frames of {} x {} pixels, expected sides of 1 to 16384", size[0], size[1]);
            return Err(Error::Option { what });
        }
        if !(options.rate >= 1e-3 && options.rate <= 1e4) {
            let what = format!("rate is {} frames a second, expected 0.001 to 10000", options.rate);
            return Err(Error::Option { what });
        }
        let (picture, rate) = (format!("{}x{}", size[0], size[1]), options.rate.to_string());
        let quality = options.quality.min(51).to_string();
        // of MPEG-4, 2 is best and 31 smallest
        let coarse = (2 + options.quality.min(51) * 29 / 51).to_string();
        let encoder: &[&str] = if has_x264(&options.programs)? {
            &["-c:v", "libx264", "-preset", "veryfast", "-crf", &quality]
        } else {
            &["-c:v", "mpeg4", "-q:v", &coarse]
        };
        let mut arguments: Vec<OsString> =
            ["-hide_banner", "-nostdin", "-v", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s"]
                .map(OsString::from)
                .to_vec();
        arguments.extend([&picture, "-r", &rate, "-i", "pipe:0"].map(OsString::from));
        // yuv420p has one colour for 2 x 2 pixels
        arguments.extend(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2"].map(OsString::from));
        arguments.extend(encoder.iter().map(OsString::from));
        // a fixed number of threads, so that the same frames give the same bytes
        arguments.extend(
            ["-threads", "2", "-pix_fmt", "yuv420p", "-fflags", "+bitexact", "-flags", "+bitexact"]
                .map(OsString::from),
        );
        arguments.extend(["-movflags", "+faststart", "-f", "mp4", "-y"].map(OsString::from));
        arguments.push(as_file(&path));
        let (running, pipes) = Running::start(&options.programs.ffmpeg, arguments, true)?;
        Ok(Self { path, size, input: pipes.input, running, frames: 0, is_finished: false })
    }

    /// Appends a frame.
    ///
    /// # Errors
    /// [`Error::FrameSize`]; [`Error::Encoder`] if ffmpeg gave up, with what it says.
    pub fn write(&mut self, frame: &Image) -> Result<()> {
        let [width, height] = self.size.map(|side| side as usize);
        if (frame.width(), frame.height()) != (width, height) {
            return Err(Error::FrameSize {
                found_width: frame.width(),
                found_height: frame.height(),
                width,
                height,
            });
        }
        match self.input.as_mut().map(|input| input.write_all(frame.rgb())) {
            Some(Ok(())) => {
                self.frames += 1;
                Ok(())
            }
            _ => {
                self.input = None;
                let (_, message) = self.running.wait()?;
                Err(self.failed(message))
            }
        }
    }

    /// Ends the file and waits until it is whole.
    ///
    /// # Errors
    /// [`Error::Encoder`] if no frame was written or ffmpeg failed, with what it says.
    pub fn finish(mut self) -> Result<()> {
        self.input = None;
        let (status, message) = self.running.wait()?;
        if self.frames == 0 || !status.success() {
            return Err(self.failed(message));
        }
        self.is_finished = true;
        Ok(())
    }

    fn failed(&self, message: String) -> Error {
        Error::Encoder { path: self.path.clone(), frames: self.frames, message }
    }
}

impl Drop for FrameWriter {
    fn drop(&mut self) {
        if !self.is_finished {
            self.input = None;
            self.running.stop();
            // it may never have been made
            let _ = fs::remove_file(&self.path);
        }
    }
}

fn has_x264(programs: &Programs) -> Result<bool> {
    let (mut running, mut pipes) = Running::start(&programs.ffmpeg, ["-hide_banner", "-encoders"], false)?;
    let mut encoders = String::new();
    pipes.output.read_to_string(&mut encoders).map_err(|source| running.failed(source))?;
    running.wait()?;
    Ok(encoders.split_whitespace().any(|word| word == "libx264"))
}
