// Numbers as Python writes them, so that page, command line and files say the same.

/** Mantissa and exponent as Python joins them: "1.5e-07". */
function scientific(text) {
  const [mantissa, exponent] = text.split("e");
  return `${mantissa}e${exponent[0]}${exponent.slice(1).padStart(2, "0")}`;
}

const special = (x) => (Number.isNaN(x) ? "nan" : x > 0 ? "inf" : "-inf");

/** Python's f"{x:.{digits}g}". */
export function general(x, digits = 6) {
  if (!Number.isFinite(x)) return special(x);
  const [mantissa, exponent] = x.toExponential(digits - 1).split("e");
  if (exponent < -4 || exponent >= digits) {
    return scientific(`${mantissa.replace(/\.?0+$/, "")}e${exponent}`);
  }
  const text = x.toFixed(digits - 1 - exponent);
  return text.includes(".") ? text.replace(/\.?0+$/, "") : text;
}

/** Python's repr of a float: "3.0", "0.1", "1e-05". */
export function float(x) {
  if (!Number.isFinite(x)) return special(x);
  const size = Math.abs(x);
  if (size !== 0 && (size < 1e-4 || size >= 1e16)) return scientific(x.toExponential());
  if (Object.is(x, -0)) return "-0.0";
  return Number.isInteger(x) ? `${x}.0` : String(x);
}
