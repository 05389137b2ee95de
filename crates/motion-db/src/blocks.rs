use crate::column::Column;

/// Number of leading principal features that bound a distance from below.
pub(crate) const PREFIX: usize = 16;
/// Rows of a block.
pub(crate) const LANES: usize = 16;

/// Rows stored in blocks of 16, feature by feature, so that 16 distances grow at once.
#[derive(Debug, Clone)]
pub(crate) struct Blocks {
    dims: usize,
    data: Column<f32>,
}

impl Blocks {
    pub fn zeros(rows: usize, dims: usize) -> Self {
        Self { dims, data: vec![0.0; Self::numbers(rows, dims)].into() }
    }

    /// Blocks from a file, which has [`Self::numbers`] of them.
    pub fn from_column(dims: usize, data: Column<f32>) -> Self {
        Self { dims, data }
    }

    /// How many numbers the blocks of `rows` rows hold.
    pub fn numbers(rows: usize, dims: usize) -> usize {
        rows.div_ceil(LANES) * LANES * dims
    }

    pub fn as_bytes(&self) -> &[u8] {
        self.data.as_bytes()
    }

    /// `fill(row, out)` gives a row's `dims` numbers.
    pub fn new(rows: usize, dims: usize, mut fill: impl FnMut(usize, &mut [f32])) -> Self {
        let mut blocks = Self::zeros(rows, dims);
        let mut scratch = vec![0.0; dims];
        for row in 0..rows {
            fill(row, &mut scratch);
            blocks.set(row, &scratch);
        }
        blocks
    }

    /// Sets a row to the first `dims` of `numbers`.
    pub fn set(&mut self, row: usize, numbers: &[f32]) {
        let dims = self.dims;
        let block = &mut self.data.to_mut()[row / LANES * LANES * dims..][..LANES * dims];
        for (d, v) in numbers[..dims].iter().enumerate() {
            block[d * LANES + row % LANES] = *v;
        }
    }

    pub fn dims(&self) -> usize {
        self.dims
    }

    /// Adds the squared, weighted distances of a block's rows to `query`.
    #[inline(always)]
    pub fn add_distances(
        &self,
        block: usize,
        query: &[f32],
        weights: Option<&[f32]>,
        sums: &mut [f32; LANES],
    ) {
        let data = &self.data[block * LANES * self.dims..][..LANES * self.dims];
        let (columns, _) = data.as_chunks::<LANES>();
        match weights {
            None => {
                for (column, q) in columns.iter().zip(query) {
                    for lane in 0..LANES {
                        let d = column[lane] - q;
                        sums[lane] += d * d;
                    }
                }
            }
            Some(weights) => {
                for ((column, q), w) in columns.iter().zip(query).zip(weights) {
                    for lane in 0..LANES {
                        let d = column[lane] - q;
                        sums[lane] += w * d * d;
                    }
                }
            }
        }
    }

    /// Squared, weighted distance of one row to `query`.
    #[inline(always)]
    pub fn distance(&self, row: usize, query: &[f32], weights: Option<&[f32]>) -> f32 {
        let mut sums = [0.0; LANES];
        self.add_distances(row / LANES, query, weights, &mut sums);
        sums[row % LANES]
    }

    /// The numbers of a row.
    pub fn copy_row(&self, row: usize, out: &mut [f64]) {
        let block = &self.data[row / LANES * LANES * self.dims..][..LANES * self.dims];
        for (d, out) in out.iter_mut().enumerate() {
            *out = f64::from(block[d * LANES + row % LANES]);
        }
    }
}
