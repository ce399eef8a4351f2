// Numbers, times and places as the page writes them.

export function capital(text) {
  return text && text[0].toUpperCase() + text.slice(1);
}

const LONGEST = 24; // characters of a name on the map

// A name as it stands on the map; cards and titles have all of it.
export function short(name) {
  return name.length > LONGEST ? `${name.slice(0, LONGEST - 1)}…` : name;
}

// The thing that a request names, after "the" where it has no such word itself.
export function thing(request) {
  return /^(the|an?|some|something|anything|somewhere)\s/i.test(request) ? request : `the ${request}`;
}

export function seconds(value) {
  return value < 10 ? `${value.toFixed(1)} s` : duration(value);
}

export function duration(value) {
  const whole = Math.round(value);
  return whole < 60 ? `${whole} s` : `${Math.floor(whole / 60)} min ${whole % 60} s`;
}

// The size of a file.
export function bytes(count) {
  return count < 1e6 ? `${Math.ceil(count / 1e3)} kB` : `${(count / 1e6).toFixed(1)} MB`;
}

// x and y of a place in metres; what follows them is left out.
export function place([x, y]) {
  return `${decimetres(x)}, ${decimetres(y)}`;
}

// Between which heights above the floor something lies, after a separator; empty if not known.
export function height(band) {
  return band ? ` · ${decimetres(band[0])} to ${decimetres(band[1])} m high` : "";
}

function decimetres(metres) {
  return (Math.round(metres * 10) / 10 || 0).toFixed(1); // || 0: never -0.0
}

// A time, without its date if that is today, in the browser's time zone.
export function clockTime(rfc3339) {
  const time = new Date(rfc3339);
  const today = time.toDateString() === new Date().toDateString();
  const date = today ? {} : { day: "numeric", month: "short", year: "numeric" };
  return time.toLocaleString("en-GB", { ...date, hour: "2-digit", minute: "2-digit" });
}
