//! Images of occupancy grids: PGM and PNG, cell by cell.

use std::ops::Range;

use zune_core::bytestream::ZCursor;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_core::result::DecodingResult;
use zune_png::PngDecoder;

/// What a pixel says: how bright it is and how opaque, both from 0 to 1.
#[derive(Clone, Copy)]
pub(super) struct Pixel {
    /// Mean of red, green and blue.
    pub shade: f64,
    /// 1 where the image has no transparency.
    pub opacity: f64,
    /// Whether the image has transparency at all.
    pub has_opacity: bool,
}

/// Cells of an image, a byte each, the first row on top.
pub(super) struct Cells {
    pub columns: usize,
    pub rows: usize,
    bytes: Vec<u8>,
    /// Where the cells lie in `bytes`.
    at: Range<usize>,
    /// For each value of a byte whether such a cell is blocked.
    pub is_blocked: [bool; 256],
}

impl Cells {
    /// The most cells.
    const MOST: usize = 100_000_000;

    /// The rows, the lowest first.
    pub fn rows_upward(&self) -> impl Iterator<Item = &[u8]> {
        self.bytes[self.at.clone()].chunks_exact(self.columns).rev()
    }

    /// The cells of a PGM or PNG file, or what is wrong with it. `is_blocked` tells what pixels mean.
    pub fn read(bytes: Vec<u8>, is_blocked: impl Fn(Pixel) -> bool) -> Result<Cells, String> {
        match bytes.get(..2) {
            Some(b"P5" | b"P2") => pgm(bytes, is_blocked),
            Some(b"\x89P") => png(&bytes, is_blocked),
            _ => Err("is neither PGM (P5, P2) nor PNG".to_owned()),
        }
    }

    /// Cells of each of which `blocked` says whether it is so.
    fn of_flags(columns: usize, rows: usize, blocked: impl Iterator<Item = bool>) -> Cells {
        let bytes: Vec<u8> = blocked.map(u8::from).collect();
        let at = 0..bytes.len();
        Cells { columns, rows, bytes, at, is_blocked: std::array::from_fn(|byte| byte == 1) }
    }
}

fn check_size(columns: usize, rows: usize) -> Result<(), String> {
    let most = Cells::MOST;
    match columns.checked_mul(rows) {
        Some(1..=Cells::MOST) => Ok(()),
        _ => Err(format!("has {columns} × {rows} pixels; expected 1 to {most} in all")),
    }
}

/// A grey pixel of an image without transparency.
fn grey(shade: f64) -> Pixel {
    Pixel { shade, opacity: 1.0, has_opacity: false }
}

/// PGM: the letters P5 (or P2 with numbers in digits), columns, rows, the largest value, and the values.
fn pgm(bytes: Vec<u8>, is_blocked: impl Fn(Pixel) -> bool) -> Result<Cells, String> {
    let is_binary = bytes[1] == b'5';
    let mut at = 2;
    let mut number = |what: &str| number(&bytes, &mut at).ok_or(format!("has no {what}"));
    let (columns, rows) = (number("number of columns")?, number("number of rows")?);
    let most = number("largest value")?;
    check_size(columns, rows)?;
    if !(1..=65_535).contains(&most) {
        return Err(format!("has the largest value {most}; expected 1 to 65535"));
    }
    let count = columns * rows;
    let short = |there: usize| {
        format!("is cut short: it has {there} of {count} values ({columns} × {rows} pixels)")
    };
    let is_value_blocked = |value: usize| is_blocked(grey(value as f64 / most as f64));
    if !is_binary {
        let mut blocked = Vec::new();
        while blocked.len() < count {
            let value = self::number(&bytes, &mut at).ok_or_else(|| short(blocked.len()))?;
            if value > most {
                return Err(format!("has the value {value}; expected at most {most}"));
            }
            blocked.push(is_value_blocked(value));
        }
        return Ok(Cells::of_flags(columns, rows, blocked.into_iter()));
    }
    // One blank ends the head.
    let from = at + 1;
    let width = if most < 256 { 1 } else { 2 };
    let there = bytes.len().saturating_sub(from) / width;
    if there < count {
        return Err(short(there));
    }
    let at = from..from + count * width;
    if width == 2 {
        let values = bytes[at].chunks_exact(2);
        let values = values.map(|b| usize::from(u16::from_be_bytes([b[0], b[1]])));
        return Ok(Cells::of_flags(columns, rows, values.map(is_value_blocked)));
    }
    Ok(Cells { columns, rows, at, is_blocked: std::array::from_fn(is_value_blocked), bytes })
}

/// The next number of a PGM, blanks and comments before it passed over.
fn number(bytes: &[u8], at: &mut usize) -> Option<usize> {
    loop {
        match bytes.get(*at)? {
            b'#' => *at += bytes[*at..].iter().position(|&b| b == b'\n')?,
            b if b.is_ascii_whitespace() => *at += 1,
            _ => break,
        }
    }
    let digits = bytes[*at..].iter().take_while(|b| b.is_ascii_digit()).count();
    let text = str::from_utf8(&bytes[*at..*at + digits]).ok()?;
    *at += digits;
    text.parse().ok()
}

fn png(bytes: &[u8], is_blocked: impl Fn(Pixel) -> bool) -> Result<Cells, String> {
    let options = DecoderOptions::new_safe().set_max_width(Cells::MOST).set_max_height(Cells::MOST);
    let options =
        options.set_strict_mode(true).png_set_confirm_crc(true).inflate_set_confirm_adler(true);
    let mut decoder = PngDecoder::new_with_options(ZCursor::new(bytes), options);
    let damaged = |e: &dyn std::fmt::Debug| {
        let text = format!("{e:?}");
        format!("is a damaged PNG: {}", text.lines().next().unwrap_or_default())
    };
    decoder.decode_headers().map_err(|e| damaged(&e))?;
    let (columns, rows) = decoder.dimensions().ok_or("is a PNG without a size")?;
    check_size(columns, rows)?;
    let decoded = decoder.decode().map_err(|e| damaged(&e))?;
    let (colours, has_opacity) = match decoder.colorspace() {
        Some(ColorSpace::Luma) => (1, false),
        Some(ColorSpace::LumaA) => (1, true),
        Some(ColorSpace::RGB) => (3, false),
        Some(ColorSpace::RGBA) => (3, true),
        _ => return Err("is a PNG with unusual colours; expected grey or RGB".to_owned()),
    };
    let blocked = |values: &mut dyn Iterator<Item = f64>| {
        let shade = values.take(colours).sum::<f64>() / colours as f64;
        let opacity = values.next().unwrap_or(1.0);
        is_blocked(Pixel { shade, opacity, has_opacity })
    };
    let channels = colours + usize::from(has_opacity);
    match decoded {
        DecodingResult::U8(values) if channels == 1 => {
            let at = 0..columns * rows;
            let is_blocked = std::array::from_fn(|byte| is_blocked(grey(byte as f64 / 255.0)));
            Ok(Cells { columns, rows, bytes: values, at, is_blocked })
        }
        DecodingResult::U8(values) => {
            let pixels = values.chunks_exact(channels);
            let mut known: Option<(&[u8], bool)> = None;
            let flags = pixels.map(|pixel| match known {
                Some((same, flag)) if same == pixel => flag,
                _ => {
                    let flag = blocked(&mut pixel.iter().map(|&v| f64::from(v) / 255.0));
                    known = Some((pixel, flag));
                    flag
                }
            });
            Ok(Cells::of_flags(columns, rows, flags))
        }
        DecodingResult::U16(values) => {
            let pixels = values.chunks_exact(channels);
            let flags = pixels.map(|p| blocked(&mut p.iter().map(|&v| f64::from(v) / 65_535.0)));
            Ok(Cells::of_flags(columns, rows, flags))
        }
        _ => Err("is a PNG with unusual values; expected 8 or 16 bits".to_owned()),
    }
}
