use std::{ffi::OsString, io::Read, path::Path};

use serde::Deserialize;

use crate::{Error, Programs, Result, Source, process::Running, source::as_file};

/// Most bytes of an answer of ffprobe.
const MAX_ANSWER: u64 = 1 << 20;

/// What is accepted; checked before memory is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// most pixels of a frame, in the file and as read
    pub max_pixels: u64,
    /// most frames
    pub max_frames: u64,
}

impl Default for Limits {
    /// Frames up to 8K (7680 × 4320), and an hour at 60 frames a second.
    fn default() -> Self {
        Self { max_pixels: 7680 * 4320, max_frames: 3600 * 60 }
    }
}

/// What is in a video file: its first picture stream.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    /// width and height of the upright picture, pixels
    pub size: [u32; 2],
    /// frames a second, on average
    pub rate: f64,
    /// frames that the container announces, or that duration and rate make; `None` if it tells neither
    pub num_frames: Option<u64>,
    /// true if `num_frames` is the container's own count
    pub is_counted: bool,
    /// duration, seconds
    pub duration_secs: Option<f64>,
    /// clockwise turn that brings the stored picture upright, degrees: 0, 90, 180 or 270; frames are read turned
    pub rotation_degrees: u32,
    /// name of the codec
    pub codec: String,
}

#[derive(Deserialize)]
struct Answer {
    #[serde(default)]
    streams: Vec<Stream>,
    #[serde(default)]
    format: Format,
}

#[derive(Deserialize)]
struct Stream {
    codec_name: Option<String>,
    width: Option<u32>,
    height: Option<u32>,
    avg_frame_rate: Option<String>,
    r_frame_rate: Option<String>,
    nb_frames: Option<String>,
    duration: Option<String>,
    #[serde(default)]
    tags: Tags,
    #[serde(default)]
    side_data_list: Vec<SideData>,
}

#[derive(Default, Deserialize)]
struct Format {
    duration: Option<String>,
}

#[derive(Default, Deserialize)]
struct Tags {
    rotate: Option<String>,
}

#[derive(Deserialize)]
struct SideData {
    rotation: Option<f64>,
}

/// Tells what is in a video file, by ffprobe.
///
/// # Errors
/// [`Error::NotAVideo`], [`Error::File`], [`Error::ProgramMissing`]; [`Error::TooLarge`] and [`Error::TooLong`] by `limits`.
pub fn probe(path: &Path, programs: &Programs, limits: &Limits) -> Result<Probe> {
    Source::Video(path.into()).check()?;
    let entries = "stream=codec_name,width,height,avg_frame_rate,r_frame_rate,nb_frames,duration:\
                   stream_tags=rotate:stream_side_data=rotation:format=duration";
    let mut arguments: Vec<OsString> = ["-hide_banner", "-v", "error"].map(OsString::from).to_vec();
    arguments.extend(Source::guards(limits.max_pixels));
    arguments.extend(["-select_streams", "v:0", "-show_entries", entries, "-of", "json"].map(OsString::from));
    arguments.extend(["-i".into(), as_file(path)]);
    let (mut running, pipes) = Running::start(&programs.ffprobe, arguments, false)?;
    let mut answer = Vec::new();
    pipes.output.take(MAX_ANSWER).read_to_end(&mut answer).map_err(|source| running.failed(source))?;
    let (status, message) = running.wait()?;
    let not_a_video = |message: String| Error::NotAVideo { path: path.into(), message };
    if !status.success() {
        return Err(not_a_video(message));
    }
    let answer: Answer = serde_json::from_slice(&answer)
        .map_err(|e| Error::Answer { program: "ffprobe".into(), what: e.to_string() })?;
    let stream = answer.streams.first().ok_or_else(|| not_a_video("it has no picture stream".into()))?;
    let probe = read(stream, &answer.format).map_err(not_a_video)?;
    check(&probe, path, limits)?;
    Ok(probe)
}

fn read(stream: &Stream, format: &Format) -> std::result::Result<Probe, String> {
    let (Some(width @ 1..), Some(height @ 1..)) = (stream.width, stream.height) else {
        return Err("its pictures have no size".into());
    };
    let rate = [&stream.avg_frame_rate, &stream.r_frame_rate]
        .into_iter()
        .find_map(|text| fraction(text.as_deref()?))
        .ok_or("its frame rate is not known")?;
    let seconds =
        |text: &Option<String>| text.as_deref()?.parse().ok().filter(|s: &f64| s.is_finite() && *s > 0.0);
    let duration_secs = seconds(&stream.duration).or_else(|| seconds(&format.duration));
    let counted =
        stream.nb_frames.as_deref().and_then(|text| text.parse().ok()).filter(|&count: &u64| count > 0);
    // The side data gives a counter-clockwise turn that was made, the older tag a clockwise turn to be made.
    let side_data = stream.side_data_list.iter().find_map(|data| data.rotation.filter(|r| r.is_finite()));
    let tag = || stream.tags.rotate.as_deref().and_then(|text| text.parse().ok());
    let turn = side_data.map(|degrees| -degrees).or_else(tag).unwrap_or(0.0);
    let rotation_degrees = ((turn / 90.0).round().rem_euclid(4.0) as u32) * 90;
    let size = if rotation_degrees % 180 == 90 { [height, width] } else { [width, height] };
    Ok(Probe {
        size,
        rate,
        num_frames: counted.or_else(|| Some((duration_secs? * rate).round() as u64)),
        is_counted: counted.is_some(),
        duration_secs,
        rotation_degrees,
        codec: stream.codec_name.clone().unwrap_or_default(),
    })
}

fn check(probe: &Probe, path: &Path, limits: &Limits) -> Result<()> {
    let [width, height] = probe.size;
    if u64::from(width) * u64::from(height) > limits.max_pixels {
        return Err(Error::TooLarge { path: path.into(), width, height, limit: limits.max_pixels });
    }
    match probe.num_frames {
        Some(found) if found > limits.max_frames => {
            Err(Error::TooLong { path: path.into(), found, limit: limits.max_frames })
        }
        _ => Ok(()),
    }
}

/// A positive rate of the form `60/1` or `29.97`.
fn fraction(text: &str) -> Option<f64> {
    let (above, below) = text.split_once('/').unwrap_or((text, "1"));
    let rate = above.parse::<f64>().ok()? / below.parse::<f64>().ok()?;
    (rate.is_finite() && rate > 0.0).then_some(rate)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(text: &str) -> std::result::Result<Probe, String> {
        let answer: Answer = serde_json::from_str(text).unwrap();
        read(&answer.streams[0], &answer.format)
    }

    #[test]
    fn a_turned_picture_is_told_upright() {
        let probe = answer(
            r#"{"streams":[{"codec_name":"h264","width":1920,"height":1080,"avg_frame_rate":"30000/1001",
                "nb_frames":"12","side_data_list":[{"rotation":-90}]}]}"#,
        )
        .unwrap();
        assert_eq!((probe.size, probe.rotation_degrees), ([1080, 1920], 90));
        assert!((probe.rate - 29.97).abs() < 0.001);
        assert_eq!((probe.num_frames, probe.is_counted), (Some(12), true));
    }

    #[test]
    fn without_a_count_duration_and_rate_tell_the_frames() {
        let probe = answer(
            r#"{"streams":[{"width":64,"height":48,"avg_frame_rate":"0/0","r_frame_rate":"25/1"}],
                "format":{"duration":"2.0"}}"#,
        )
        .unwrap();
        assert_eq!((probe.num_frames, probe.is_counted, probe.rate), (Some(50), false, 25.0));
    }

    #[test]
    fn pictures_without_size_or_rate_are_no_video() {
        assert!(answer(r#"{"streams":[{"avg_frame_rate":"25/1"}]}"#).unwrap_err().contains("no size"));
        assert!(answer(r#"{"streams":[{"width":4,"height":4,"avg_frame_rate":"0/0"}]}"#).is_err());
    }
}
