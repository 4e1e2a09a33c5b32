#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace scarp {

/// A running 128-bit hash over bytes, to compare results; not for secrets.
///
/// Pieces add up: hashing "ab" is hashing "a" and then "b". Source: xxHash, XXH3 with 128 bits.
class Hash {
 public:
  Hash();
  ~Hash();
  Hash(Hash&&) noexcept;
  Hash& operator=(Hash&&) noexcept;

  void add(std::span<const std::byte> bytes);
  void add(std::string_view text) { add(std::as_bytes(std::span(text))); }

  /// The bytes of numbers as they lie in memory; types with gaps between their members are refused.
  template <class T>
  void add_values(std::span<const T> values) {
    static_assert(std::is_floating_point_v<T> || std::has_unique_object_representations_v<T>);
    add(std::as_bytes(values));
  }
  template <class T>
  void add_value(const T& value) {
    add_values(std::span<const T>(&value, 1));
  }

  /// 32 hexadecimal digits, for what was added so far.
  std::string hex() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

std::string hash_of(std::string_view text);

}  // namespace scarp
