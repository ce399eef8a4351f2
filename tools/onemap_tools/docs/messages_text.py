"""The parts of the page of messages that are not read from the code."""

from __future__ import annotations

NOTE = "<!-- Generated: change the code, then run `make docs-pages`. -->"

INTRODUCTION = f"""{NOTE}
# Messages

Everything that travels between processes. A program in any language that has Zenoh and msgpack
can take part: a robot publishes [RgbdFrame](#rgbdframe) and [Odometry](#odometry) and obeys
[VelocityCommand](#velocitycommand).

- **Connection.** Every process is a Zenoh 1.x client of one router (measured with 1.10.2), by
  default `tcp/127.0.0.1:7447`. With `bus.namespace` all keys have that prefix.
- **Frames of reference.** Map and body: x forward, y left, z up. Camera: x right, y down,
  z forward. `T_map_camera` takes points of the camera frame to the map frame.
- **Delivery.** All topics are published with congestion control "drop". frame: priority
  "data low", for images and features; state: priority "data"; command: priority "real time",
  express, in a Zenoh session of its own, so that no image delays it.
- **Latched.** Who publishes also answers queries on the same key with the newest message. Who
  subscribes asks once at the beginning.
- **Procedures.** A query on the key, with the request as its payload and attachment. The reply
  is a message in the same form. An error reply is JSON with `code`, `message` and `details`;
  one that waited too long for its turn is refused with the code `busy`.
- **A robot brakes by itself** when the last command has run out (`validity_ms` after it arrived).
"""

LAYOUT = """## On the wire

A message is two byte strings: the **header** is the Zenoh attachment, the **body** the payload.
The encoding `application/octet-stream` with the schema's name is set, but not read.

The header is a msgpack map with three keys:

- `schema`: `onemap.` + name of the message + `/{version}`, for example `onemap.Odometry/{version}`.
- `values`: a map with every field that is neither array nor bytes. Lists are msgpack arrays, a
  value of several fields is a map of them. A number may be sent as an integer; an integer must be
  one.
- `arrays`: a map with, for every array, the list of dtype, shape (a list) and the offset in the
  body. A field of bytes is sent as an array of uint8 with one axis.

The body holds the arrays one after the other, little-endian, the last axis contiguous, each
padded with zeros to a multiple of {alignment} bytes, so that each begins at one. Without arrays it
is empty; a query has a payload even then.

All fields must be there, except those that may be left out by their table: they were added later,
and the receiver takes the default that stands there. It ignores values that it does not know. An
array has the dtype and the shape that the message's table states; their names in the header:
{dtypes}. Limits: {dimensions} axes, {header_bytes} bytes of header, {body_bytes} bytes of body. A
receiver refuses a packet that breaks one of these rules, or holds a value that the message does not
allow, as a whole.

An array may be **compressed**, if the sender's `bus.link` says so ([links](links.md)): its list
then has a codec and the number of its bytes in the body as fourth and fifth entry, and dtype and
shape are those of the array that it unpacks to. A receiver that does not know the codec refuses the
packet and names those that it knows.

| codec | of | bytes |
|---|---|---|
| `delta-zlib` | uint8, uint16 | the differences; nothing is lost |
| `jpeg` | images: uint8, three channels | a JPEG file |
| `int8` | `features`, float16 | a float32 scale for each patch; the differences of int8 numbers |
| `log8` | `variance`, float32 | low and step, two float32; the differences of uint8 codes |

A feature is its number times the scale of its patch. A variance of code c is 2 to the power of
low + (c - 1) step, of code 0 infinity. *Differences* are one zlib stream: each value less the value
before it on the second axis (the first: less 0), modulo 256 or 65536. A difference d of 16 bits,
taken as signed, is written as 2d if d >= 0, else as -2d - 1; the low bytes of all of them come
first, then the high bytes.

**Receipts** say which frame or field the next stage took, whatever the sender's settings are. A
sender may wait for them, so that no queue grows on a slow link: it sends the newest frame once
fewer than its window are without a receipt. A receipt counts for all frames sent before it.
"""

ENUMS = """## Enumerations
"""
