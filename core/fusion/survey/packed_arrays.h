// Arrays of plain values as compressed bytes and back, for the same build. In blocks, so that no
// second copy of the whole is ever made; of each first all first bytes of its values, then all
// second ones, and so on: that is faster and smaller.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

#include "core/base/bytes.h"
#include "core/base/compression.h"

namespace atlas {
namespace packed_arrays_internal {

template <typename T>
inline constexpr std::size_t kBlockValues = (std::size_t{256} << 10) / sizeof(T);

// Calls `visit(value, byte)` for all bytes of `count` values, few values at a time: they stay in a
// cache.
template <typename T, typename Visit>
void VisitBytes(std::size_t count, const Visit& visit) {
  constexpr std::size_t kAtOnce = 512;
  for (std::size_t first = 0; first < count; first += kAtOnce) {
    const std::size_t end = std::min(count, first + kAtOnce);
    for (std::size_t byte = 0; byte < sizeof(T); ++byte) {
      for (std::size_t i = first; i < end; ++i) {
        visit(i, byte);
      }
    }
  }
}

template <typename T>
void Pack(const std::vector<T>& values, ByteWriter& out) {
  static_assert(std::is_trivially_copyable_v<T>);
  constexpr int kLevel = 1;
  out.Varint(values.size());
  Bytes plain;
  for (std::size_t first = 0; first < values.size(); first += kBlockValues<T>) {
    const std::size_t count = std::min(kBlockValues<T>, values.size() - first);
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(values.data() + first);
    plain.resize(count * sizeof(T));
    VisitBytes<T>(count, [=, to = plain.data()](std::size_t i, std::size_t byte) {
      to[byte * count + i] = bytes[i * sizeof(T) + byte];
    });
    const Bytes packed = Compress(plain, kLevel);
    out.Varint(packed.size());
    out.Raw(packed);
  }
}

template <typename T>
void Unpack(ByteReader& in, std::vector<T>& values) {
  values = std::vector<T>(in.Varint());
  for (std::size_t first = 0; first < values.size(); first += kBlockValues<T>) {
    const std::size_t count = std::min(kBlockValues<T>, values.size() - first);
    const Bytes plain = Decompress(in.Raw(in.Varint()), count * sizeof(T)).value();
    auto* bytes = reinterpret_cast<std::uint8_t*>(values.data() + first);
    VisitBytes<T>(count, [=, from = plain.data()](std::size_t i, std::size_t byte) {
      bytes[i * sizeof(T) + byte] = from[byte * count + i];
    });
  }
}

}  // namespace packed_arrays_internal

template <typename... T>
Bytes PackArrays(const std::vector<T>&... arrays) {
  ByteWriter out;
  (packed_arrays_internal::Pack(arrays, out), ...);
  Bytes packed = out.Take();
  packed.shrink_to_fit();
  return packed;
}

// `packed` comes from PackArrays of as many arrays of the same types, by the same build.
template <typename... T>
void UnpackArrays(ByteSpan packed, std::vector<T>&... arrays) {
  ByteReader in(packed);
  (packed_arrays_internal::Unpack(in, arrays), ...);
}

}  // namespace atlas
