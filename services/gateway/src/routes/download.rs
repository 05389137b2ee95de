//! Sending a stored object: streamed, with its checksum as ETag, whole or in part.

use axum::{
    body::{Body, Bytes},
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::Response,
};
use futures::{Stream, StreamExt};
use store::Key;

use crate::{
    App,
    error::{Error, Result},
};

/// Part of an object that is read at once when a range is sent, bytes.
const PIECE_BYTES: u64 = 1 << 20;

/// What is known of an object.
#[derive(Debug)]
pub(super) struct Object<'a> {
    pub name: &'a str,
    pub store_key: &'a str,
    pub bytes: i64,
    pub blake3: &'a str,
    pub media_type: &'a str,
}

/// Answers a GET of `object`.
pub(super) async fn send(app: &App, headers: &HeaderMap, object: &Object<'_>) -> Result<Response> {
    let key: Key = object.store_key.parse()?;
    let bytes = u64::try_from(object.bytes).map_err(|e| Error::Internal(e.to_string()))?;
    let etag = format!("\"{}\"", object.blake3);
    let mut response = if is_current(headers, &etag) {
        let mut response = Response::new(Body::empty());
        *response.status_mut() = StatusCode::NOT_MODIFIED;
        response
    } else if let Some((first, last)) = wanted_range(headers, &etag, bytes)? {
        let mut response = Response::new(Body::from_stream(pieces(app.clone(), key, first, last + 1)));
        *response.status_mut() = StatusCode::PARTIAL_CONTENT;
        set(&mut response, header::CONTENT_RANGE, &format!("bytes {first}-{last}/{bytes}"))?;
        set(&mut response, header::CONTENT_LENGTH, &(last + 1 - first).to_string())?;
        response
    } else {
        let (size, stream) = app.store.stream(&key).await?;
        let mut response = Response::new(Body::from_stream(stream));
        set(&mut response, header::CONTENT_LENGTH, &size.to_string())?;
        response
    };
    set(&mut response, header::ETAG, &etag)?;
    set(&mut response, header::ACCEPT_RANGES, "bytes")?;
    set(&mut response, header::CONTENT_TYPE, object.media_type)?;
    set(&mut response, header::X_CONTENT_TYPE_OPTIONS, "nosniff")?;
    set(&mut response, header::CONTENT_DISPOSITION, &disposition(object.name))?;
    Ok(response)
}

fn set(response: &mut Response, name: header::HeaderName, value: &str) -> Result<()> {
    let value = HeaderValue::try_from(value).map_err(|e| Error::Internal(format!("{name}: {e}")))?;
    response.headers_mut().insert(name, value);
    Ok(())
}

fn is_current(headers: &HeaderMap, etag: &str) -> bool {
    headers.get(header::IF_NONE_MATCH).and_then(|v| v.to_str().ok()).is_some_and(|value| {
        value.split(',').any(|tag| matches!(tag.trim(), "*") || tag.trim().trim_start_matches("W/") == etag)
    })
}

/// First and last byte of a single `Range: bytes=…`; several ranges, other units and a stale `If-Range` give the whole.
fn wanted_range(headers: &HeaderMap, etag: &str, bytes: u64) -> Result<Option<(u64, u64)>> {
    let Some(header) = headers.get(header::RANGE).and_then(|v| v.to_str().ok()) else { return Ok(None) };
    if headers.get(header::IF_RANGE).is_some_and(|tag| tag.as_bytes() != etag.as_bytes()) {
        return Ok(None);
    }
    let Some((first, last)) = header.strip_prefix("bytes=").and_then(|range| range.split_once('-')) else {
        return Ok(None);
    };
    let refuse = || Error::RangeNotSatisfiable { found: header.to_owned(), bytes };
    let range = match (first.trim().parse::<u64>(), last.trim().parse::<u64>()) {
        (Ok(first), Ok(last)) if first <= last => (first, last.min(bytes.saturating_sub(1))),
        (Ok(first), Err(_)) if last.trim().is_empty() => (first, bytes.saturating_sub(1)),
        (Err(_), Ok(suffix)) if first.trim().is_empty() && suffix > 0 => {
            (bytes.saturating_sub(suffix), bytes.saturating_sub(1))
        }
        _ => return Ok(None),
    };
    if range.0 >= bytes { Err(refuse()) } else { Ok(Some(range)) }
}

fn pieces(
    app: App,
    key: Key,
    start: u64,
    end: u64,
) -> impl Stream<Item = Result<Bytes, store::Error>> + Send {
    futures::stream::unfold(start, move |at| {
        let (app, key) = (app.clone(), key.clone());
        async move {
            let upto = end.min(at + PIECE_BYTES);
            (at < upto).then_some(())?;
            Some((app.store.get_range(&key, at..upto).await, upto))
        }
    })
    .fuse()
}

/// `attachment`, with the name in ASCII for all and in UTF-8 (RFC 6266) for most.
fn disposition(name: &str) -> String {
    let ascii: String = name
        .chars()
        .map(|c| if c.is_ascii_graphic() && c != '"' && c != '\\' || c == ' ' { c } else { '_' })
        .collect();
    if ascii == name {
        return format!("attachment; filename=\"{ascii}\"");
    }
    let encoded: String = name
        .bytes()
        .map(|b| {
            if b.is_ascii_alphanumeric() || b"-._~".contains(&b) {
                char::from(b).to_string()
            } else {
                format!("%{b:02X}")
            }
        })
        .collect();
    format!("attachment; filename=\"{ascii}\"; filename*=UTF-8''{encoded}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn range(value: &'static str, bytes: u64) -> Result<Option<(u64, u64)>> {
        wanted_range(
            &HeaderMap::from_iter([(header::RANGE, HeaderValue::from_static(value))]),
            "\"e\"",
            bytes,
        )
    }

    #[test]
    fn single_ranges_are_cut_at_the_end_of_the_file() {
        assert_eq!(range("bytes=0-3", 10).unwrap(), Some((0, 3)));
        assert_eq!(range("bytes=4-", 10).unwrap(), Some((4, 9)));
        assert_eq!(range("bytes=4-99", 10).unwrap(), Some((4, 9)));
        assert_eq!(range("bytes=-3", 10).unwrap(), Some((7, 9)));
        assert_eq!(range("bytes=-99", 10).unwrap(), Some((0, 9)));
    }

    #[test]
    fn a_range_behind_the_end_is_refused_and_an_odd_one_ignored() {
        assert!(range("bytes=10-", 10).is_err());
        assert!(range("bytes=0-", 0).is_err());
        for odd in ["bytes=5-2", "bytes=-0", "bytes=a-b", "frames=1-2", "bytes=0-1,3-4"] {
            assert_eq!(range(odd, 10).unwrap(), None, "{odd}");
        }
    }

    #[test]
    fn names_that_are_not_ascii_are_encoded() {
        assert_eq!(disposition("a b.csv"), "attachment; filename=\"a b.csv\"");
        assert_eq!(disposition("ä\".csv"), "attachment; filename=\"__.csv\"; filename*=UTF-8''%C3%A4%22.csv");
    }
}
