// Arrays of plain values as one compressed blob and back, within one process.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

#include "core/base/bytes.h"
#include "core/base/compression.h"

namespace atlas {
namespace packed_arrays_internal {

template <typename T>
void Append(const T* values, std::size_t count, Bytes& out) {
  static_assert(std::is_trivially_copyable_v<T>);
  const auto* begin = reinterpret_cast<const std::uint8_t*>(values);
  out.insert(out.end(), begin, begin + count * sizeof(T));
}

template <typename T>
void Take(T* values, std::size_t count, ByteSpan& rest) {
  std::copy_n(rest.begin(), count * sizeof(T), reinterpret_cast<std::uint8_t*>(values));
  rest = rest.subspan(count * sizeof(T));
}

template <typename T>
void TakeArray(std::vector<T>& values, ByteSpan& rest) {
  std::uint64_t count = 0;
  Take(&count, 1, rest);
  values.resize(count);
  Take(values.data(), count, rest);
}

template <typename T>
void AppendArray(std::vector<T>& values, Bytes& out) {
  const std::uint64_t count = values.size();
  Append(&count, 1, out);
  Append(values.data(), count, out);
  values = std::vector<T>();
}

}  // namespace packed_arrays_internal

// Empties the arrays, memory and all.
template <typename... T>
Bytes PackArrays(std::vector<T>&... arrays) {
  constexpr int kLevel = 1;
  Bytes plain;
  plain.reserve((... + (sizeof(std::uint64_t) + arrays.size() * sizeof(T))));
  (packed_arrays_internal::AppendArray(arrays, plain), ...);
  Bytes packed = Compress(plain, kLevel);
  const std::uint64_t size = plain.size();
  packed_arrays_internal::Append(&size, 1, packed);
  packed.shrink_to_fit();
  return packed;
}

// `packed` comes from PackArrays of as many arrays of the same types, in this process.
template <typename... T>
void UnpackArrays(ByteSpan packed, std::vector<T>&... arrays) {
  std::uint64_t size = 0;
  ByteSpan size_bytes = packed.last(sizeof(size));
  packed_arrays_internal::Take(&size, 1, size_bytes);
  const Bytes plain = Decompress(packed.first(packed.size() - sizeof(size)), size).value();
  ByteSpan rest = plain;
  (packed_arrays_internal::TakeArray(arrays, rest), ...);
}

}  // namespace atlas
