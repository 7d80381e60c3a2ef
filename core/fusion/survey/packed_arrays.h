// Arrays of plain values as one compressed blob and back, for the same build. Compressed are first
// all first bytes of an array's values, then all second ones, and so on: that is faster and
// smaller.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

#include "core/base/bytes.h"
#include "core/base/compression.h"

namespace atlas {
namespace packed_arrays_internal {

inline constexpr std::size_t kBlock = 512;  // values at a time, so that they stay in a cache

template <typename T>
void Append(const std::vector<T>& values, std::uint8_t*& out) {
  static_assert(std::is_trivially_copyable_v<T>);
  const std::uint64_t count = values.size();
  std::memcpy(out, &count, sizeof(count));
  out += sizeof(count);
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(values.data());
  for (std::size_t first = 0; first < count; first += kBlock) {
    const std::size_t end = std::min<std::size_t>(count, first + kBlock);
    for (std::size_t byte = 0; byte < sizeof(T); ++byte) {
      for (std::size_t i = first; i < end; ++i) {
        out[byte * count + i] = bytes[i * sizeof(T) + byte];
      }
    }
  }
  out += count * sizeof(T);
}

template <typename T>
void Take(const std::uint8_t*& in, std::vector<T>& values) {
  std::uint64_t count = 0;
  std::memcpy(&count, in, sizeof(count));
  in += sizeof(count);
  values.resize(count);
  auto* bytes = reinterpret_cast<std::uint8_t*>(values.data());
  for (std::size_t first = 0; first < count; first += kBlock) {
    const std::size_t end = std::min<std::size_t>(count, first + kBlock);
    for (std::size_t byte = 0; byte < sizeof(T); ++byte) {
      for (std::size_t i = first; i < end; ++i) {
        bytes[i * sizeof(T) + byte] = in[byte * count + i];
      }
    }
  }
  in += count * sizeof(T);
}

}  // namespace packed_arrays_internal

template <typename... T>
Bytes PackArrays(const std::vector<T>&... arrays) {
  constexpr int kLevel = 1;
  const std::uint64_t size = (... + (sizeof(std::uint64_t) + arrays.size() * sizeof(T)));
  Bytes plain(size);
  std::uint8_t* end = plain.data();
  (packed_arrays_internal::Append(arrays, end), ...);
  Bytes packed = Compress(plain, kLevel);
  const auto* size_bytes = reinterpret_cast<const std::uint8_t*>(&size);
  packed.insert(packed.end(), size_bytes, size_bytes + sizeof(size));
  packed.shrink_to_fit();
  return packed;
}

// `packed` comes from PackArrays of as many arrays of the same types, by the same build.
template <typename... T>
void UnpackArrays(ByteSpan packed, std::vector<T>&... arrays) {
  std::uint64_t size = 0;
  std::memcpy(&size, packed.last(sizeof(size)).data(), sizeof(size));
  const Bytes plain = Decompress(packed.first(packed.size() - sizeof(size)), size).value();
  const std::uint8_t* begin = plain.data();
  (packed_arrays_internal::Take(begin, arrays), ...);
}

}  // namespace atlas
