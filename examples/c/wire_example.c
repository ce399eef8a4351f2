/* Writes an odometry message and a frame to standard output, each as two lengths (uint32) and the
 * bytes of header and body; then reads the header of a velocity command, with its length, and
 * prints what it says.
 *
 *     cc -std=c99 -Wall -Wextra -Werror -o wire_example wire_example.c
 *
 * In a robot, header and body go to Zenoh instead: z_publisher_put of zenoh-c with the body as
 * payload and the header as options.attachment, under the keys of onemap_wire.h.
 */
#include <stdio.h>
#include <stdlib.h>

#include "onemap_wire.h"

#define WIDTH 7 /* odd, so that the arrays need padding */
#define HEIGHT 5

static void write_packet(const om_header *header, const uint8_t *body, size_t size) {
  uint32_t sizes[2] = {(uint32_t)header->size, (uint32_t)size};
  if (header->size > OM_MAX_HEADER) exit(1);
  fwrite(sizes, sizeof sizes, 1, stdout);
  fwrite(header->data, header->size, 1, stdout);
  fwrite(body, size, 1, stdout);
}

int main(void) {
  om_header header;
  om_odometry odometry = {
      .sequence = 41,
      .stamp_ns = 1700000000000000000,
      .T_map_body = {1, 0, 0, 1.5, 0, 1, 0, -2, 0, 0, 1, 0, 0, 0, 0, 1},
      .linear_mps = 0.5,
      .angular_radps = -0.25,
      .planner = "5f3a9c01d2e4",
      .command_sequence = 300,
      .driver = "0b6d1f52a7c3",
  };
  uint8_t odometry_body[sizeof(double[16])];
  om_odometry_header(&odometry, &header);
  om_odometry_body(&odometry, odometry_body);
  write_packet(&header, odometry_body, om_odometry_body_size());

  uint8_t rgb[HEIGHT * WIDTH * 3];
  uint16_t depth_mm[HEIGHT * WIDTH];
  for (int i = 0; i < HEIGHT * WIDTH * 3; i++) rgb[i] = (uint8_t)i;
  for (int i = 0; i < HEIGHT * WIDTH; i++) depth_mm[i] = (uint16_t)(1000 + i);
  om_rgbd_frame frame = {
      .sequence = 7,
      .stamp_ns = 1700000000000000000,
      .width = WIDTH,
      .height = HEIGHT,
      .fx = 195, .fy = 195, .cx = 3, .cy = 2,
      .T_map_camera = {0, 0, 1, 1.6, -1, 0, 0, -2, 0, -1, 0, 1, 0, 0, 0, 1},
      .rgb = rgb,
      .depth_mm = depth_mm,
  };
  uint8_t *body = malloc(om_rgbd_body_size(&frame));
  if (body == NULL) return 1;
  om_rgbd_header(&frame, &header);
  om_rgbd_body(&frame, body);
  write_packet(&header, body, om_rgbd_body_size(&frame));
  free(body);
  fflush(stdout);

  uint32_t size = 0;
  uint8_t received[4096];
  if (fread(&size, sizeof size, 1, stdin) != 1 || size > sizeof received) return 1;
  if (fread(received, 1, size, stdin) != size) return 1;
  om_velocity_command command;
  if (!om_read_velocity_command(received, size, &command)) {
    fprintf(stderr, "not a velocity command\n");
    return 3;
  }
  printf("%lld %lld %.17g %.17g %lld %s %s %lld\n", (long long)command.sequence,
         (long long)command.stamp_ns, command.linear_mps, command.angular_radps,
         (long long)command.validity_ms, command.planner, command.driver,
         (long long)command.odometry_stamp_ns);
  return 0;
}
