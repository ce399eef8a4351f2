/* OneMap's messages of a robot as bytes, in C99 without libraries.
 *
 * A message is a header, which travels as the Zenoh attachment, and a body, the payload; see
 * docs/messages.md. This file writes RgbdFrame and Odometry and reads VelocityCommand. It assumes
 * a little-endian machine, which every robot computer of today is.
 */
#ifndef ONEMAP_WIRE_H
#define ONEMAP_WIRE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define OM_KEY_RGBD "robot/rgbd/v1"         /* priority data low, congestion control drop */
#define OM_KEY_ODOMETRY "robot/odometry/v1" /* priority data, congestion control drop */
#define OM_KEY_CMD_VEL "robot/cmd_vel/v1"   /* subscribe in a session of its own */
#define OM_MAX_HEADER 1024                  /* enough for both messages that are written here */
#define OM_NAME 65                          /* bytes of a process's name, with the final 0 */
#define OM_MAX_VALIDITY_MS 300              /* a command that says more is none */

typedef struct { uint8_t data[OM_MAX_HEADER]; size_t size; } om_header;

/* Row by row, T_map_body and T_map_camera take points of body and camera to the map. */
typedef struct {
  int64_t sequence, stamp_ns;
  double T_map_body[16];
  double linear_mps, angular_radps;
  bool collided;
  char planner[OM_NAME];    /* whose commands are followed; empty: of none */
  int64_t command_sequence; /* of the newest command; 0 before the first */
  char driver[OM_NAME];     /* another one at each start: follow no command for another driver */
} om_odometry;

typedef struct {
  int64_t sequence, stamp_ns;
  uint32_t width, height;
  double fx, fy, cx, cy;     /* pixels of the depth image */
  double T_map_camera[16];   /* camera: x right, y down, z forward */
  const uint8_t *rgb;        /* height x width x 3, row 0 on top */
  const uint16_t *depth_mm;  /* height x width, along the optical axis, 0: no return */
} om_rgbd_frame;

typedef struct {
  int64_t sequence, stamp_ns, validity_ms, odometry_stamp_ns;
  double linear_mps, angular_radps;
  char planner[OM_NAME], driver[OM_NAME];
} om_velocity_command;

/* ---- msgpack, as far as headers need it ---- */

static inline void om_put(om_header *h, const void *bytes, size_t count) {
  if (h->size + count <= OM_MAX_HEADER) memcpy(h->data + h->size, bytes, count);
  h->size += count; /* a size beyond OM_MAX_HEADER says that it did not fit */
}

static inline void om_byte(om_header *h, uint8_t value) { om_put(h, &value, 1); }

static inline void om_big_endian(om_header *h, uint8_t type, uint64_t value, int bytes) {
  om_byte(h, type);
  for (int i = bytes - 1; i >= 0; i--) om_byte(h, (uint8_t)(value >> (8 * i)));
}

static inline void om_map(om_header *h, unsigned count) { om_byte(h, (uint8_t)(0x80 | count)); }

static inline void om_list(om_header *h, unsigned count) { om_byte(h, (uint8_t)(0x90 | count)); }

static inline void om_text(om_header *h, const char *text) {
  size_t length = strlen(text);
  if (length < 32) om_byte(h, (uint8_t)(0xa0 | length));
  else om_big_endian(h, 0xd9, length, 1);
  om_put(h, text, length);
}

static inline void om_integer(om_header *h, int64_t value) {
  if (value >= -32 && value < 128) om_byte(h, (uint8_t)value);
  else om_big_endian(h, 0xd3, (uint64_t)value, 8);
}

static inline void om_number(om_header *h, double value) {
  uint64_t bits;
  memcpy(&bits, &value, 8);
  om_big_endian(h, 0xcb, bits, 8);
}

static inline void om_array(om_header *h, const char *name, const char *dtype, const uint32_t *shape,
                            unsigned axes, size_t offset) {
  om_text(h, name);
  om_list(h, 3);
  om_text(h, dtype);
  om_list(h, axes);
  for (unsigned i = 0; i < axes; i++) om_integer(h, shape[i]);
  om_integer(h, (int64_t)offset);
}

static inline size_t om_padded(size_t bytes) { return (bytes + 7) / 8 * 8; }

/* ---- Odometry ---- */

static inline void om_odometry_header(const om_odometry *m, om_header *h) {
  const uint32_t matrix[2] = {4, 4};
  h->size = 0;
  om_map(h, 3);
  om_text(h, "schema"), om_text(h, "onemap.Odometry/1");
  om_text(h, "values"), om_map(h, 8);
  om_text(h, "sequence"), om_integer(h, m->sequence);
  om_text(h, "stamp_ns"), om_integer(h, m->stamp_ns);
  om_text(h, "linear_mps"), om_number(h, m->linear_mps);
  om_text(h, "angular_radps"), om_number(h, m->angular_radps);
  om_text(h, "collided"), om_byte(h, m->collided ? 0xc3 : 0xc2);
  om_text(h, "planner"), om_text(h, m->planner);
  om_text(h, "command_sequence"), om_integer(h, m->command_sequence);
  om_text(h, "driver"), om_text(h, m->driver);
  om_text(h, "arrays"), om_map(h, 1);
  om_array(h, "T_map_body", "<f8", matrix, 2, 0);
}

static inline size_t om_odometry_body_size(void) { return sizeof(double[16]); }

static inline void om_odometry_body(const om_odometry *m, uint8_t *body) {
  memcpy(body, m->T_map_body, sizeof m->T_map_body);
}

/* ---- RgbdFrame: rgb, depth_mm and T_map_camera, each at a multiple of 8 bytes ---- */

static inline size_t om_depth_offset(const om_rgbd_frame *m) {
  return om_padded((size_t)3 * m->width * m->height);
}

static inline size_t om_pose_offset(const om_rgbd_frame *m) {
  return om_depth_offset(m) + om_padded((size_t)2 * m->width * m->height);
}

static inline size_t om_rgbd_body_size(const om_rgbd_frame *m) {
  return om_pose_offset(m) + sizeof m->T_map_camera;
}

static inline void om_rgbd_header(const om_rgbd_frame *m, om_header *h) {
  const uint32_t image[3] = {m->height, m->width, 3}, matrix[2] = {4, 4};
  h->size = 0;
  om_map(h, 3);
  om_text(h, "schema"), om_text(h, "onemap.RgbdFrame/1");
  om_text(h, "values"), om_map(h, 3);
  om_text(h, "sequence"), om_integer(h, m->sequence);
  om_text(h, "stamp_ns"), om_integer(h, m->stamp_ns);
  om_text(h, "intrinsics"), om_map(h, 4);
  om_text(h, "fx"), om_number(h, m->fx);
  om_text(h, "fy"), om_number(h, m->fy);
  om_text(h, "cx"), om_number(h, m->cx);
  om_text(h, "cy"), om_number(h, m->cy);
  om_text(h, "arrays"), om_map(h, 3);
  om_array(h, "rgb", "|u1", image, 3, 0);
  om_array(h, "depth_mm", "<u2", image, 2, om_depth_offset(m));
  om_array(h, "T_map_camera", "<f8", matrix, 2, om_pose_offset(m));
}

static inline void om_rgbd_body(const om_rgbd_frame *m, uint8_t *body) {
  memset(body, 0, om_rgbd_body_size(m));
  memcpy(body, m->rgb, (size_t)3 * m->width * m->height);
  memcpy(body + om_depth_offset(m), m->depth_mm, (size_t)2 * m->width * m->height);
  memcpy(body + om_pose_offset(m), m->T_map_camera, sizeof m->T_map_camera);
}

/* ---- reading ---- */

typedef struct { const uint8_t *at, *end; bool bad; } om_reader;

static inline uint64_t om_take(om_reader *r, size_t bytes) {
  uint64_t value = 0;
  if ((size_t)(r->end - r->at) < bytes) { r->bad = true, r->at = r->end; return 0; }
  while (bytes--) value = value << 8 | *r->at++;
  return value;
}

/* The number of bytes of a text, or of entries of a map or list; what follows is read next. */
static inline bool om_head(om_reader *r, char *kind, uint64_t *count) {
  uint8_t type = (uint8_t)om_take(r, 1);
  if ((type & 0xf0) == 0x80) return *kind = 'm', *count = type & 0x0f, !r->bad;
  if ((type & 0xf0) == 0x90) return *kind = 'l', *count = type & 0x0f, !r->bad;
  if ((type & 0xe0) == 0xa0) return *kind = 't', *count = type & 0x1f, !r->bad;
  switch (type) {
    case 0xd9: return *kind = 't', *count = om_take(r, 1), !r->bad;
    case 0xda: return *kind = 't', *count = om_take(r, 2), !r->bad;
    case 0xdc: return *kind = 'l', *count = om_take(r, 2), !r->bad;
    case 0xde: return *kind = 'm', *count = om_take(r, 2), !r->bad;
    default: r->at -= !r->bad; return *kind = 'v', *count = 0, !r->bad; /* a plain value */
  }
}

/* A plain value as a double and as an integer. */
static inline void om_value(om_reader *r, double *number, int64_t *integer) {
  uint8_t type = (uint8_t)om_take(r, 1);
  uint64_t bits;
  *number = 0, *integer = 0;
  if (type < 0x80 || type >= 0xe0) { *integer = (int8_t)type; }
  else switch (type) {
    case 0xc0: case 0xc2: case 0xc3: *integer = type == 0xc3; break;
    case 0xcb: bits = om_take(r, 8); memcpy(number, &bits, 8); *integer = 0; return;
    case 0xcc: *integer = (int64_t)om_take(r, 1); break;
    case 0xcd: *integer = (int64_t)om_take(r, 2); break;
    case 0xce: *integer = (int64_t)om_take(r, 4); break;
    case 0xcf: case 0xd3: *integer = (int64_t)om_take(r, 8); break;
    case 0xd0: *integer = (int8_t)om_take(r, 1); break;
    case 0xd1: *integer = (int16_t)om_take(r, 2); break;
    case 0xd2: *integer = (int32_t)om_take(r, 4); break;
    default: r->bad = true;
  }
  *number = (double)*integer;
}

/* A text of at most ``room`` - 1 bytes, cut off if it is longer. */
static inline void om_read_text(om_reader *r, uint64_t length, char *text, size_t room) {
  size_t kept = length < room ? (size_t)length : room - 1;
  if ((uint64_t)(r->end - r->at) < length) { r->bad = true, r->at = r->end, text[0] = 0; return; }
  memcpy(text, r->at, kept);
  text[kept] = 0;
  r->at += length;
}

/* The velocity command of a header; false if it is none. Its body is empty. */
static inline bool om_read_velocity_command(const uint8_t *header, size_t size,
                                            om_velocity_command *m) {
  om_reader r = {header, header + size, false};
  char kind, name[OM_NAME], text[OM_NAME];
  uint64_t parts, count;
  unsigned found = 0;
  memset(m, 0, sizeof *m);
  m->validity_ms = OM_MAX_VALIDITY_MS;
  if (!om_head(&r, &kind, &parts) || kind != 'm') return false;
  while (parts-- && !r.bad) {
    if (!om_head(&r, &kind, &count) || kind != 't') return false;
    om_read_text(&r, count, name, sizeof name);
    if (!om_head(&r, &kind, &count)) return false;
    if (!strcmp(name, "schema")) {
      if (kind != 't') return false;
      om_read_text(&r, count, text, sizeof text);
      if (strcmp(text, "onemap.VelocityCommand/1")) return false;
      continue;
    }
    if (kind != 'm') return false;
    for (uint64_t entries = count; entries && !r.bad; entries--) {
      double number;
      int64_t integer;
      if (!om_head(&r, &kind, &count) || kind != 't') return false;
      om_read_text(&r, count, name, sizeof name);
      if (!om_head(&r, &kind, &count)) return false;
      if (kind == 't') {
        om_read_text(&r, count, text, sizeof text);
        if (!strcmp(name, "planner")) memcpy(m->planner, text, sizeof text);
        if (!strcmp(name, "driver")) memcpy(m->driver, text, sizeof text);
        continue;
      }
      if (kind != 'v') return false; /* a command has no lists, maps or arrays */
      om_value(&r, &number, &integer);
      if (!strcmp(name, "sequence")) m->sequence = integer, found |= 1;
      if (!strcmp(name, "stamp_ns")) m->stamp_ns = integer, found |= 2;
      if (!strcmp(name, "linear_mps")) m->linear_mps = number, found |= 4;
      if (!strcmp(name, "angular_radps")) m->angular_radps = number, found |= 8;
      if (!strcmp(name, "validity_ms")) m->validity_ms = integer;
      if (!strcmp(name, "odometry_stamp_ns")) m->odometry_stamp_ns = integer;
    }
  }
  return !r.bad && found == 15 && m->validity_ms >= 0 && m->validity_ms <= OM_MAX_VALIDITY_MS &&
         m->linear_mps - m->linear_mps == 0 &&
         m->angular_radps - m->angular_radps == 0; /* neither NaN nor infinite */
}

#endif
