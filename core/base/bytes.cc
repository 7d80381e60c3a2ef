#include "core/base/bytes.h"

#include <array>

namespace atlas {

void ByteWriter::Fixed(std::uint64_t value, int bytes) {
  std::array<std::uint8_t, 8> little;
  for (std::size_t i = 0; i < little.size(); ++i) {
    little[i] = static_cast<std::uint8_t>(value >> (8 * i));
  }
  bytes_.insert(bytes_.end(), little.begin(), little.begin() + bytes);
}

void ByteWriter::Varint(std::uint64_t value) {
  while (value >= 0x80) {
    bytes_.push_back(static_cast<std::uint8_t>(value | 0x80));
    value >>= 7;
  }
  bytes_.push_back(static_cast<std::uint8_t>(value));
}

void ByteWriter::SignedVarint(std::int64_t value) {
  const auto bits = static_cast<std::uint64_t>(value);
  Varint((bits << 1) ^ (value < 0 ? ~std::uint64_t{0} : 0));
}

void ByteWriter::String(std::string_view text) {
  Varint(text.size());
  bytes_.insert(bytes_.end(), text.begin(), text.end());
}

std::uint64_t ByteReader::Fixed(std::size_t size) {
  if (!ok_ || remaining() < size) {
    ok_ = false;
    return 0;
  }
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < size; ++i) {
    value |= std::uint64_t{bytes_[position_ + i]} << (8 * i);
  }
  position_ += size;
  return value;
}

std::uint64_t ByteReader::Varint() {
  std::uint64_t value = 0;
  for (int shift = 0; shift < 64; shift += 7) {
    const std::uint8_t byte = U8();
    if (shift == 63 && byte > 1) {
      break;
    }
    value |= std::uint64_t{byte & 0x7Fu} << shift;
    if ((byte & 0x80) == 0) {
      return ok_ ? value : 0;
    }
  }
  ok_ = false;
  return 0;
}

std::int64_t ByteReader::SignedVarint() {
  const std::uint64_t bits = Varint();
  return static_cast<std::int64_t>((bits >> 1) ^ (~(bits & 1) + 1));
}

ByteSpan ByteReader::Raw(std::size_t size) {
  if (!ok_ || remaining() < size) {
    ok_ = false;
    return {};
  }
  const ByteSpan view = bytes_.subspan(position_, size);
  position_ += size;
  return view;
}

std::string_view ByteReader::String(std::size_t max_size) {
  const std::uint64_t size = Varint();
  if (!ok_ || size > max_size) {
    ok_ = false;
    return {};
  }
  const ByteSpan raw = Raw(static_cast<std::size_t>(size));
  // Bytes are text here: the one place where the two views of the same memory meet.
  return {reinterpret_cast<const char*>(raw.data()), raw.size()};
}

}  // namespace atlas
