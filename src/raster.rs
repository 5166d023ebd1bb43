//! A rectangle of pixels, made row by row on all cores.

/// `width` × `height` values in rows from the top, each row from the left.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster<T> {
    width: u32,
    height: u32,
    values: Vec<T>,
}

impl<T> Raster<T> {
    /// Collects the rows that `row` makes: it is called once for each row j and returns its `width` values. With the
    /// feature `rayon` rows are made in parallel by the current thread pool; the result does not depend on it.
    ///
    /// # Panics
    /// If a row has another length.
    pub fn from_rows(width: u32, height: u32, row: impl Fn(u32) -> Vec<T> + Sync) -> Self
    where
        T: Send,
    {
        let values = each_row(height, |j| {
            let values = row(j);
            assert_eq!(values.len(), width as usize, "row {j} has the wrong length");
            values
        });
        Self { width, height, values: values.into_iter().flatten().collect() }
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The value of pixel (i, j): column i from the left, row j from the top.
    ///
    /// # Panics
    /// If the pixel is outside.
    #[must_use]
    pub fn at(&self, i: u32, j: u32) -> &T {
        assert!(i < self.width && j < self.height, "pixel ({i}, {j}) is outside {} × {}", self.width, self.height);
        &self.values[j as usize * self.width as usize + i as usize]
    }

    /// All values, in rows from the top.
    #[must_use]
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// The same rectangle with every value passed through `f`.
    pub fn map<U>(&self, f: impl FnMut(&T) -> U) -> Raster<U> {
        Raster { width: self.width, height: self.height, values: self.values.iter().map(f).collect() }
    }
}

/// What `row` makes of 0, 1, …, in that order, whoever computes which.
pub(crate) fn each_row<R: Send>(height: u32, row: impl Fn(u32) -> R + Sync) -> Vec<R> {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        (0..height).into_par_iter().with_max_len(1).map(&row).collect()
    }
    #[cfg(not(feature = "rayon"))]
    {
        (0..height).map(&row).collect()
    }
}

impl<T> Raster<T> {
    /// Puts together what [`each_row`] made.
    pub(crate) fn assemble(width: u32, height: u32, rows: impl Iterator<Item = Vec<T>>) -> Self {
        Self { width, height, values: rows.flatten().collect() }
    }
}
