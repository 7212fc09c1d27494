//! Lossless serialisation of a replay buffer.
//!
//! Observations change little from step to step, and the next observation of a transition is
//! usually the observation of the following one. So each observation is written as the XOR of its
//! bits with those of the previously written observation: a bit mask of the words that differ, followed
//! by these words only. This shrinks a buffer of padded scenes to about a tenth.
//!
//! Layout, all numbers little-endian: [`MAGIC`], observation length, action length, capacity,
//! number of transitions, next slot (u64 each), the transitions in slot order (delta of `s`,
//! delta of `s'`, words of `a` and `r`, one byte `d`), CRC-32C of everything before it (u32).

use super::{MAX_CAPACITY, ReplayBuffer, ReplayError, Transition};

const MAGIC: [u8; 8] = *b"MGEREPL1";
const CHECKSUM_LEN: usize = size_of::<u32>();

/// Longest observation of an empty buffer.
const MAX_LENGTH: usize = 1 << 20;

impl ReplayBuffer {
    /// The whole buffer, for a checkpoint. [`Self::from_bytes`] restores an equal one.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        for number in [self.observation_len, self.action_len, self.capacity, self.len(), self.next] {
            bytes.extend_from_slice(&(number as u64).to_le_bytes());
        }
        let mut previous = vec![0; self.observation_len];
        for transition in (0..self.len()).filter_map(|slot| self.get(slot)) {
            write_delta(transition.observation, &mut previous, &mut bytes);
            write_delta(transition.next_observation, &mut previous, &mut bytes);
            for value in transition.action.iter().chain([&transition.reward]) {
                bytes.extend_from_slice(&value.to_le_bytes());
            }
            bytes.push(u8::from(transition.terminated));
        }
        let checksum = crc32c::crc32c(&bytes);
        bytes.extend_from_slice(&checksum.to_le_bytes());
        bytes
    }

    /// The buffer that [`Self::to_bytes`] wrote.
    ///
    /// # Errors
    /// [`ReplayError::Damaged`] if the bytes are anything else.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ReplayError> {
        let (bytes, checksum) = bytes
            .len()
            .checked_sub(CHECKSUM_LEN)
            .map(|end| bytes.split_at(end))
            .ok_or(ReplayError::Damaged("it is cut off"))?;
        if !bytes.starts_with(&MAGIC) {
            return Err(ReplayError::Damaged("it does not begin with the right header"));
        }
        if crc32c::crc32c(bytes).to_le_bytes() != checksum {
            return Err(ReplayError::Damaged("its checksum does not match"));
        }
        let mut reader = Reader(&bytes[MAGIC.len()..]);
        let [observation_len, action_len, capacity, len, next] = reader.header()?;
        if !(1..=MAX_CAPACITY).contains(&capacity)
            || len > capacity
            || next >= capacity
            || (len < capacity && next != len)
        {
            return Err(ReplayError::Damaged("its counters contradict each other"));
        }
        // Every number of a transition takes at least one bit, so this bounds the memory by the size of the input.
        let longest = if len == 0 { MAX_LENGTH } else { 8 * bytes.len() };
        if observation_len.max(action_len) > longest {
            return Err(ReplayError::Damaged("it is cut off"));
        }
        let mut buffer = Self::new(observation_len, action_len, capacity);
        let mut previous = vec![0; observation_len];
        let mut observation = vec![0.0; observation_len];
        let mut next_observation = vec![0.0; observation_len];
        let mut action = vec![0.0; action_len];
        for _ in 0..len {
            reader.delta(&mut previous, &mut observation)?;
            reader.delta(&mut previous, &mut next_observation)?;
            for value in &mut action {
                *value = f32::from_bits(reader.word()?);
            }
            let reward = f32::from_bits(reader.word()?);
            let terminated = reader.byte()? != 0;
            buffer.push(Transition {
                observation: &observation,
                action: &action,
                reward,
                next_observation: &next_observation,
                terminated,
            })?;
        }
        if !reader.0.is_empty() {
            return Err(ReplayError::Damaged("it has trailing bytes"));
        }
        buffer.next = next;
        Ok(buffer)
    }
}

/// Appends the difference between `values` and `previous`, and sets `previous` to `values`.
fn write_delta(values: &[f32], previous: &mut [u32], bytes: &mut Vec<u8>) {
    let mask_start = bytes.len();
    bytes.resize(mask_start + values.len().div_ceil(8), 0);
    for (i, (value, previous)) in values.iter().zip(previous).enumerate() {
        let difference = value.to_bits() ^ *previous;
        if difference != 0 {
            bytes[mask_start + i / 8] |= 1 << (i % 8);
            bytes.extend_from_slice(&difference.to_le_bytes());
            *previous = value.to_bits();
        }
    }
}

/// The bytes still to be read.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], ReplayError> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or(ReplayError::Damaged("it is cut off"))?;
        self.0 = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], ReplayError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    fn byte(&mut self) -> Result<u8, ReplayError> {
        Ok(self.array::<1>()?[0])
    }

    fn word(&mut self) -> Result<u32, ReplayError> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    fn header(&mut self) -> Result<[usize; 5], ReplayError> {
        let mut numbers = [0; 5];
        for number in &mut numbers {
            *number = usize::try_from(u64::from_le_bytes(self.array()?))
                .map_err(|_| ReplayError::Damaged("its counters contradict each other"))?;
        }
        Ok(numbers)
    }

    fn delta(&mut self, previous: &mut [u32], values: &mut [f32]) -> Result<(), ReplayError> {
        let mask = self.take(values.len().div_ceil(8))?;
        for (i, (value, previous)) in values.iter_mut().zip(previous).enumerate() {
            if mask[i / 8] & (1 << (i % 8)) != 0 {
                *previous ^= self.word()?;
            }
            *value = f32::from_bits(*previous);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Episodes of ten steps in a padded scene of 160 numbers, four of which change.
    fn recorded(count: usize, capacity: usize) -> ReplayBuffer {
        let mut buffer = ReplayBuffer::new(160, 2, capacity);
        let scene = |step: usize| {
            let mut scene = [0.0; 160];
            scene[20..60].fill(0.25);
            (0..4).for_each(|i| scene[i] = ((step * 4 + i) as f32).sin());
            scene
        };
        for step in 0..count {
            buffer
                .push(Transition {
                    observation: &scene(step),
                    action: &[(step as f32).cos(), -0.0],
                    reward: step as f32 / 7.0,
                    next_observation: &scene(step + 1),
                    terminated: step % 10 == 9,
                })
                .unwrap();
        }
        buffer
    }

    #[test]
    fn bytes_restore_an_equal_buffer() {
        for (count, capacity) in [(0, 5), (3, 5), (5, 5), (12, 5)] {
            let buffer = recorded(count, capacity);
            let mut restored = ReplayBuffer::from_bytes(&buffer.to_bytes()).unwrap();
            assert_eq!(restored, buffer);
            // The ring continues at the same slot.
            let mut buffer = buffer;
            let more = recorded(1, 1);
            buffer.push(more.get(0).unwrap()).unwrap();
            restored.push(more.get(0).unwrap()).unwrap();
            assert_eq!(restored, buffer);
        }
    }

    #[test]
    fn padded_scenes_shrink_to_a_tenth() {
        let buffer = recorded(1000, 1000);
        let raw = buffer.len() * (2 * 160 + 2 + 1) * 4;
        let written = buffer.to_bytes().len();
        assert!(written * 10 < raw, "{written} of {raw} bytes");
    }

    #[test]
    fn all_damage_is_detected() {
        let bytes = recorded(3, 5).to_bytes();
        for end in 0..bytes.len() {
            assert!(ReplayBuffer::from_bytes(&bytes[..end]).is_err(), "cut at {end}");
        }
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x10;
            assert!(ReplayBuffer::from_bytes(&damaged).is_err(), "flipped at {at}");
        }
    }

    #[test]
    fn wrong_counters_with_a_correct_checksum_are_an_error() {
        let contradiction = ReplayError::Damaged("its counters contradict each other");
        let cut_off = ReplayError::Damaged("it is cut off");
        for (count, field, value, expected) in [
            (3, 0, u64::MAX, &cut_off),
            (3, 0, 1 << 40, &cut_off),
            (3, 1, 1 << 40, &cut_off),
            (3, 2, 0, &contradiction),
            (3, 3, 6, &contradiction),
            (3, 4, 2, &contradiction),
            (5, 4, 5, &contradiction),
            (5, 4, 6, &contradiction),
        ] {
            let mut bytes = recorded(count, 5).to_bytes();
            bytes.truncate(bytes.len() - CHECKSUM_LEN);
            bytes[MAGIC.len() + 8 * field..][..8].copy_from_slice(&value.to_le_bytes());
            let checksum = crc32c::crc32c(&bytes);
            bytes.extend_from_slice(&checksum.to_le_bytes());
            assert_eq!(&ReplayBuffer::from_bytes(&bytes).unwrap_err(), expected, "field {field} as {value}");
        }
    }

    #[test]
    fn trailing_bytes_are_an_error() {
        let mut bytes = recorded(3, 5).to_bytes();
        bytes.truncate(bytes.len() - CHECKSUM_LEN);
        bytes.push(0);
        let checksum = crc32c::crc32c(&bytes);
        bytes.extend_from_slice(&checksum.to_le_bytes());
        let error = ReplayBuffer::from_bytes(&bytes).unwrap_err();
        assert_eq!(error, ReplayError::Damaged("it has trailing bytes"));
    }
}
