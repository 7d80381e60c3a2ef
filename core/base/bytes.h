// Little-endian byte writer and bounds-checked reader: the only way core reads or writes formats.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace atlas {

using Bytes = std::vector<std::uint8_t>;
using ByteSpan = std::span<const std::uint8_t>;

// Appends to an owned buffer.
class ByteWriter {
 public:
  void Reserve(std::size_t bytes) { bytes_.reserve(bytes); }  // for all that is to be written
  void U8(std::uint8_t value) { bytes_.push_back(value); }
  void U16(std::uint16_t value) { Fixed(value, 2); }
  void U32(std::uint32_t value) { Fixed(value, 4); }
  void U64(std::uint64_t value) { Fixed(value, 8); }
  void I16(std::int16_t value) { U16(static_cast<std::uint16_t>(value)); }
  void I32(std::int32_t value) { U32(static_cast<std::uint32_t>(value)); }
  void I64(std::int64_t value) { U64(static_cast<std::uint64_t>(value)); }
  // LEB128: 7 bits a byte, lowest first.
  void Varint(std::uint64_t value);
  // Zigzag, then LEB128.
  void SignedVarint(std::int64_t value);
  void Raw(ByteSpan bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  // Varint length, then the bytes.
  void String(std::string_view text);

  std::size_t size() const { return bytes_.size(); }
  const Bytes& bytes() const { return bytes_; }
  Bytes Take() { return std::move(bytes_); }

 private:
  void Fixed(std::uint64_t value, int bytes);

  Bytes bytes_;
};

// Reads hostile bytes. After the first read past the end every read returns zero and ok() is false;
// callers check ok() before they believe or allocate anything.
class ByteReader {
 public:
  explicit ByteReader(ByteSpan bytes) : bytes_(bytes) {}

  std::uint8_t U8() { return static_cast<std::uint8_t>(Fixed(1)); }
  std::uint16_t U16() { return static_cast<std::uint16_t>(Fixed(2)); }
  std::uint32_t U32() { return static_cast<std::uint32_t>(Fixed(4)); }
  std::uint64_t U64() { return Fixed(8); }
  std::int16_t I16() { return static_cast<std::int16_t>(U16()); }
  std::int32_t I32() { return static_cast<std::int32_t>(U32()); }
  std::int64_t I64() { return static_cast<std::int64_t>(U64()); }
  std::uint64_t Varint();
  std::int64_t SignedVarint();
  // A view into the input; empty when there are fewer bytes left.
  ByteSpan Raw(std::size_t size);
  std::string_view String(std::size_t max_size);

  bool ok() const { return ok_; }
  std::size_t remaining() const { return bytes_.size() - position_; }
  std::size_t position() const { return position_; }
  void Fail() { ok_ = false; }

 private:
  std::uint64_t Fixed(std::size_t size);

  ByteSpan bytes_;
  std::size_t position_ = 0;
  bool ok_ = true;
};

}  // namespace atlas
