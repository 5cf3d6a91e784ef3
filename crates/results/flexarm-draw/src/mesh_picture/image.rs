//! An image in memory, and its encoding as PNG.
//!
//! Start at [`Image::new`] and [`Image::to_png`]. Not here: lines and text ([`super::draw`]).

/// Red, green, blue.
pub use crate::palette::Rgb;

/// Pixels of a picture, four bytes each, row by row from the top left.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Red, green, blue, alpha; `4 * width * height` bytes.
    pub rgba: Vec<u8>,
}

/// Reason why an image cannot become a PNG file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PngError {
    /// A side is longer than the format allows.
    #[error("{pixels} pixels are too many for a PNG")]
    TooLarge {
        /// Length of the side.
        pixels: usize,
    },
    /// The encoder refuses the image.
    #[error("{cause}")]
    Encoder {
        /// Message of the encoder.
        cause: String,
    },
}

impl Image {
    /// Creates an image of one colour.
    pub fn new(width: usize, height: usize, color: Rgb) -> Self {
        let [r, g, b] = color;
        Self { width, height, rgba: [r, g, b, 255].repeat(width * height) }
    }

    /// Creates a fully transparent image.
    pub fn see_through(width: usize, height: usize) -> Self {
        Self { width, height, rgba: vec![0; 4 * width * height] }
    }

    /// Returns the colour of a pixel; black outside.
    pub fn pixel(&self, x: usize, y: usize) -> Rgb {
        let at = 4 * (y * self.width + x);
        match self.rgba.get(at..at + 3) {
            Some(&[r, g, b]) if x < self.width => [r, g, b],
            _ => [0; 3],
        }
    }

    /// Blends `color` over a pixel; `alpha` 1 covers it. No effect outside.
    pub fn blend(&mut self, x: usize, y: usize, color: Rgb, alpha: f32) {
        if x >= self.width || y >= self.height {
            return;
        }
        let [old @ .., opacity] = &mut self.rgba.as_chunks_mut::<4>().0[y * self.width + x];
        let ground = f32::from(*opacity) / 255.0 * (1.0 - alpha);
        let whole = alpha + ground;
        if whole > 0.0 {
            for (old, new) in old.iter_mut().zip(color) {
                *old = ((f32::from(new) * alpha + f32::from(*old) * ground) / whole).round() as u8;
            }
            *opacity = (255.0 * whole).round() as u8;
        }
    }

    /// Copies `other` with its top left corner at (`left`, `top`), clipped to this image.
    pub fn paste(&mut self, other: &Self, left: usize, top: usize) {
        let columns = other.width.min(self.width.saturating_sub(left));
        for y in 0..other.height.min(self.height.saturating_sub(top)) {
            let from = 4 * y * other.width;
            let to = 4 * ((top + y) * self.width + left);
            self.rgba[to..to + 4 * columns].copy_from_slice(&other.rgba[from..from + 4 * columns]);
        }
    }

    /// Encodes the image as a PNG file without date or program name: the same image gives the same
    /// bytes.
    ///
    /// # Errors
    /// If the image has no pixels, or more than a PNG can hold.
    pub fn to_png(&self) -> Result<Vec<u8>, PngError> {
        self.png(png::Compression::Balanced)
    }

    /// The same with faster compression, which takes more bytes.
    pub(crate) fn to_png_quickly(&self) -> Result<Vec<u8>, PngError> {
        self.png(png::Compression::Fast)
    }

    fn png(&self, compression: png::Compression) -> Result<Vec<u8>, PngError> {
        let size = |pixels: usize| u32::try_from(pixels).map_err(|_| PngError::TooLarge { pixels });
        let failed = |error: png::EncodingError| PngError::Encoder { cause: error.to_string() };
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, size(self.width)?, size(self.height)?);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(compression);
        let mut writer = encoder.write_header().map_err(failed)?;
        writer.write_image_data(&self.rgba).map_err(failed)?;
        writer.finish().map_err(failed)?;
        Ok(bytes)
    }
}
