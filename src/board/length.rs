//! Lengths as people write them.

use super::Error;

/// Metres from a number with a unit: `20.875mm`, `2.0875 cm`, `0.020875 m`, `1in`. A bare number is refused: which
/// unit was meant cannot be guessed.
pub fn length_m(text: &str) -> Result<f64, Error> {
    let error = || Error::Length(text.to_owned());
    let trimmed = text.trim();
    let split = trimmed
        .find(|c: char| c.is_ascii_alphabetic() && c != 'e' && c != 'E')
        .ok_or_else(error)?;
    let (number, unit) = trimmed.split_at(split);
    let metres_per_unit = match unit {
        "mm" => 1e-3,
        "cm" => 1e-2,
        "m" => 1.0,
        "in" => 0.0254,
        _ => return Err(error()),
    };
    let value: f64 = number.trim().parse().map_err(|_| error())?;
    if !value.is_finite() {
        return Err(error());
    }
    Ok(value * metres_per_unit)
}

/// A length with its unit, as a person would write it; [`length_m`] reads exactly the same number back.
///
/// Millimetres with at most six digits after the point where that says it all, else metres with all digits.
pub fn length_text(metres: f64) -> String {
    let millimetres = format!("{}mm", (metres * 1e9).round() / 1e6);
    if length_m(&millimetres) == Ok(metres) { millimetres } else { format!("{metres}m") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths() {
        for (text, expected) in [
            ("20.875mm", 0.020875),
            ("2.0875 cm", 0.020875),
            ("1in", 0.0254),
            ("0.5 m", 0.5),
            ("2e1mm", 0.02),
        ] {
            assert!((length_m(text).unwrap() - expected).abs() < 1e-15, "{text}");
        }
        for text in ["20.875", "", "mm", "nanmm", "infm", "20 furlongs", "1e999m"] {
            assert!(length_m(text).is_err(), "{text}");
        }
    }

    #[test]
    fn lengths_come_back_to_the_last_bit() {
        assert_eq!(length_text(length_m("20.875mm").unwrap()), "20.875mm");
        assert_eq!(length_text(length_m("24mm").unwrap()), "24mm");
        for metres in [0.020875, 0.0104375, 0.1 + 0.2, 1.0 / 3.0, 0.0254 / 7.0, 1e-4, 10.0] {
            assert_eq!(length_m(&length_text(metres)), Ok(metres), "{metres}");
        }
    }
}
