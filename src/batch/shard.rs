//! A batch split over the machines of a cluster.

use std::str::FromStr;

/// One of several parts of a batch, each of which a process of its own bakes: every input is in
/// exactly one, and neighbors, which tend to be alike, are in different ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: usize,
    count: usize,
}

impl Default for Shard {
    /// The whole batch as one shard.
    fn default() -> Self {
        Self { index: 0, count: 1 }
    }
}

impl Shard {
    /// The inputs of this part, in order.
    pub fn take<T>(self, inputs: Vec<T>) -> Vec<T> {
        inputs.into_iter().skip(self.index).step_by(self.count).collect()
    }
}

impl FromStr for Shard {
    type Err = String;

    /// Reads `2/5`: the second of five.
    fn from_str(text: &str) -> Result<Self, String> {
        let parts =
            text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((index @ 1.., count)) if index <= count => Ok(Self { index: index - 1, count }),
            _ => Err(format!("{text} is no part like 2/5, the second of five")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::Job;

    #[test]
    fn every_input_is_in_exactly_one_part() {
        let job = |n: usize| Job::new("out".into(), n.to_string().into());
        let jobs: Vec<Job> = (0..11).map(job).collect();
        let part = |text: &str| text.parse::<Shard>().unwrap().take(jobs.clone());
        let mut all = [part("1/3"), part("2/3"), part("3/3")].concat();
        assert_eq!(part("3/3"), [job(2), job(5), job(8)]);
        all.sort_by_key(|job| jobs.iter().position(|other| other == job));
        assert_eq!(all, jobs);
        assert_eq!(Shard::default().take(jobs.clone()), jobs);
        assert!(part("12/12").is_empty());
        for text in ["0/3", "4/3", "1", "1/0", "a/b", "-1/2"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
