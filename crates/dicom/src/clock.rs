//! The date and time of what is written.

/// The one date and time that is written wherever "now" is meant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Clock {
    /// YYYYMMDD.
    pub date: String,
    /// HHMMSS.
    pub time: String,
}

impl Clock {
    /// Reads `2026-03-01 14:05:00`, also with a `T` between date and time; none when it is no date
    /// of the calendar.
    pub fn parse(text: &str) -> Option<Self> {
        let (date, time) = text.split_once([' ', 'T'])?;
        let [year, month, day] = parts(date, '-', [4, 2, 2])?;
        let [hour, minute, second] = parts(time, ':', [2, 2, 2])?;
        let good = (1..=12).contains(&month)
            && (1..=days(year, month)).contains(&day)
            && hour < 24
            && minute < 60
            && second < 60;
        let [date, time] = [date.replace('-', ""), time.replace(':', "")];
        good.then_some(Self { date, time })
    }
}

impl std::fmt::Display for Clock {
    /// As [`Clock::parse`] reads it.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let part =
            |text: &'_ str, from: usize, to: usize| text.get(from..to).unwrap_or("").to_owned();
        let (date, time) = (&self.date, &self.time);
        let [year, month, day] = [part(date, 0, 4), part(date, 4, 6), part(date, 6, 8)];
        let [hour, minute, second] = [part(time, 0, 2), part(time, 2, 4), part(time, 4, 6)];
        write!(f, "{year}-{month}-{day} {hour}:{minute}:{second}")
    }
}

/// Whole numbers of so many digits each.
fn parts(text: &str, between: char, digits: [usize; 3]) -> Option<[u32; 3]> {
    let texts: Vec<&str> = text.split(between).collect();
    let texts: [&str; 3] = texts.try_into().ok()?;
    let mut numbers = [0; 3];
    for ((number, text), digits) in numbers.iter_mut().zip(texts).zip(digits) {
        if text.len() != digits || !text.bytes().all(|b| b.is_ascii_digit()) {
            return None;
        }
        *number = text.parse().ok()?;
    }
    Some(numbers)
}

/// Days of a month of the Gregorian calendar.
fn days(year: u32, month: u32) -> u32 {
    let leap = year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    match month {
        2 => 28 + u32::from(leap),
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_is_read_and_said_in_one_form() {
        for text in ["2026-03-01 14:05:09", "2024-02-29 00:00:00", "2000-02-29 23:59:59"] {
            let clock = Clock::parse(text).unwrap();
            assert_eq!(clock.to_string(), text);
            assert_eq!(Clock::parse(&text.replace(' ', "T")), Some(clock));
        }
        let clock = Clock::parse("2026-03-01 14:05:09").unwrap();
        assert_eq!((clock.date.as_str(), clock.time.as_str()), ("20260301", "140509"));
    }

    #[test]
    fn what_is_no_date_is_refused() {
        for text in [
            "",
            "now",
            "2026-03-01",
            "2026-3-1 14:05:09",
            "2026-13-01 14:05:09",
            "2026-02-29 14:05:09",
            "1900-02-29 00:00:00",
            "2026-03-01 24:00:00",
            "2026-03-01 14:60:00",
            "2026-03-01 14:05",
            "2026-03-00 14:05:09",
            "2026-03-01 14:05:09 ",
            "2026-03-01 +4:05:09",
        ] {
            assert_eq!(Clock::parse(text), None, "{text}");
        }
    }
}
