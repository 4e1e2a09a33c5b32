#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace scarp {

/// Writes records; database unit 1 nm.
class GdsWriter {
 public:
  explicit GdsWriter(double user_unit = 1e-3, double metres = 1e-9) {
    shorts(0x00, {600});
    shorts(0x01, std::vector<int>(12, 0));
    text(0x02, "LIB");
    reals(0x03, {user_unit, metres});
  }
  void record(int kind, int type, const std::string& body) {
    const std::size_t length = body.size() + 4;
    bytes_ += static_cast<char>(length >> 8);
    bytes_ += static_cast<char>(length & 0xff);
    bytes_ += static_cast<char>(kind);
    bytes_ += static_cast<char>(type);
    bytes_ += body;
  }
  void shorts(int kind, const std::vector<int>& values) { record(kind, 2, integers(values, 2)); }
  void longs(int kind, const std::vector<int>& values) { record(kind, 3, integers(values, 4)); }
  void text(int kind, std::string value) {
    if (value.size() % 2 != 0) value += '\0';
    record(kind, 6, value);
  }
  void reals(int kind, const std::vector<double>& values) {
    std::string body;
    for (const double value : values) {
      int exponent = 0;
      double mantissa = std::abs(value);
      while (mantissa >= 1) mantissa /= 16, ++exponent;
      while (mantissa > 0 && mantissa < 1.0 / 16) mantissa *= 16, --exponent;
      auto bits = static_cast<std::uint64_t>(std::ldexp(mantissa, 56));
      bits |= static_cast<std::uint64_t>(exponent + 64) << 56;
      if (value < 0) bits |= std::uint64_t{1} << 63;
      for (int shift = 56; shift >= 0; shift -= 8) body += static_cast<char>(bits >> shift & 0xff);
    }
    record(kind, 5, body);
  }
  void cell(const std::string& name, const std::function<void()>& elements) {
    shorts(0x05, std::vector<int>(12, 0));
    text(0x06, name);
    elements();
    record(0x07, 0, "");
  }
  void boundary(int layer, int datatype, const std::vector<int>& xy) {
    record(0x08, 0, "");
    shorts(0x0d, {layer});
    shorts(0x0e, {datatype});
    longs(0x10, xy);
    record(0x11, 0, "");
  }
  void rectangle(int layer, int x0, int y0, int x1, int y1) {
    boundary(layer, 0, {x0, y0, x1, y0, x1, y1, x0, y1, x0, y0});
  }
  void path(int layer, int type, int width, const std::vector<int>& xy) {
    record(0x09, 0, "");
    shorts(0x0d, {layer});
    shorts(0x0e, {0});
    shorts(0x21, {type});
    longs(0x0f, {width});
    if (type == 4) {
      longs(0x30, {10});
      longs(0x31, {20});
    }
    longs(0x10, xy);
    record(0x11, 0, "");
  }
  void box(int layer, int x0, int y0, int x1, int y1) {
    record(0x2d, 0, "");
    shorts(0x0d, {layer});
    shorts(0x2e, {0});
    longs(0x10, {x0, y0, x1, y0, x1, y1, x0, y1, x0, y0});
    record(0x11, 0, "");
  }
  struct Turn {
    bool mirrored = false;
    double magnification = 1;
    double angle = 0;
  };
  void reference(const std::string& name, const std::vector<int>& xy, const Turn& turn,
                 const std::vector<int>& columns_rows = {}) {
    record(columns_rows.empty() ? 0x0a : 0x0b, 0, "");
    text(0x12, name);
    shorts(0x1a, {turn.mirrored ? 0x8000 : 0});
    reals(0x1b, {turn.magnification});
    reals(0x1c, {turn.angle});
    if (!columns_rows.empty()) shorts(0x13, columns_rows);
    longs(0x10, xy);
    record(0x11, 0, "");
  }
  std::string finish() {
    record(0x04, 0, "");
    return bytes_;
  }

 private:
  static std::string integers(const std::vector<int>& values, int size) {
    std::string body;
    for (const int value : values) {
      for (int shift = 8 * (size - 1); shift >= 0; shift -= 8) {
        body += static_cast<char>(static_cast<unsigned>(value) >> shift & 0xff);
      }
    }
    return body;
  }
  std::string bytes_;
};

}  // namespace scarp
