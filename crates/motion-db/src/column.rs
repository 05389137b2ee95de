use std::marker::PhantomData;
use std::ops::Deref;

use bytemuck::Pod;
use bytes::Bytes;

/// Numbers that are either owned or lie in a file's bytes, mapped or read, and are used where they are.
#[derive(Debug, Clone)]
pub(crate) enum Column<T> {
    Owned(Vec<T>),
    /// aligned, and a whole number of `T`
    Shared(Bytes, PhantomData<T>),
}

impl<T: Pod> Column<T> {
    /// The numbers of `bytes`, whose length is a multiple of the size of `T`. Bytes that do not lie as `T` must are copied.
    pub fn shared(bytes: Bytes) -> Self {
        match bytemuck::try_cast_slice::<u8, T>(&bytes) {
            Ok(_) => Self::Shared(bytes, PhantomData),
            Err(_) => {
                let mut owned = vec![T::zeroed(); bytes.len() / size_of::<T>()];
                let whole = owned.len() * size_of::<T>();
                bytemuck::cast_slice_mut(&mut owned).copy_from_slice(&bytes[..whole]);
                Self::Owned(owned)
            }
        }
    }

    /// The numbers, to be changed; shared ones are copied first.
    pub fn to_mut(&mut self) -> &mut Vec<T> {
        if let Self::Shared(..) = self {
            *self = Self::Owned(self.to_vec());
        }
        match self {
            Self::Owned(owned) => owned,
            Self::Shared(..) => unreachable!("made owned above"),
        }
    }

    pub fn as_bytes(&self) -> &[u8] {
        bytemuck::cast_slice(self)
    }
}

impl<T> From<Vec<T>> for Column<T> {
    fn from(owned: Vec<T>) -> Self {
        Self::Owned(owned)
    }
}

impl<T: Pod> Deref for Column<T> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        match self {
            Self::Owned(owned) => owned,
            Self::Shared(bytes, _) => bytemuck::cast_slice(bytes),
        }
    }
}

impl<T: Pod + PartialEq> PartialEq for Column<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_that_lie_askew_are_copied_and_the_others_are_not() {
        let numbers = [1.0f32, -2.5, 3.25];
        let mut bytes = vec![0u8; 64];
        let start = bytes.as_ptr().align_offset(4);
        for askew in 0..4 {
            let at = start + askew;
            bytes[at..at + 12].copy_from_slice(bytemuck::cast_slice(&numbers));
            let column = Column::<f32>::shared(Bytes::from(bytes.clone()).slice(at..at + 12));
            assert_eq!(*column, numbers);
        }
        assert!(Column::<f32>::shared(Bytes::new()).is_empty());
        let mut column = Column::<f32>::shared(Bytes::copy_from_slice(bytemuck::cast_slice(&numbers)));
        column.to_mut().push(4.0);
        assert_eq!(*column, [1.0, -2.5, 3.25, 4.0]);
    }
}
