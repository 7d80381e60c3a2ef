#include "core/base/planes.h"

namespace atlas {

void WritePlanes(std::span<const std::uint32_t> values, int planes, ByteWriter& out) {
  Bytes plane(values.size());
  for (int p = 0; p < planes; ++p) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      plane[i] = static_cast<std::uint8_t>(values[i] >> (8 * p));
    }
    out.Raw(plane);
  }
}

std::vector<std::uint32_t> ReadPlanes(ByteReader& in, std::size_t count, int planes) {
  std::vector<std::uint32_t> values;
  for (int p = 0; p < planes; ++p) {
    const ByteSpan plane = in.Raw(count);
    if (!in.ok()) {
      return {};
    }
    values.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      values[i] |= std::uint32_t{plane[i]} << (8 * p);
    }
  }
  return values;
}

void WriteNibbles(std::span<const std::uint8_t> values, ByteWriter& out) {
  Bytes packed((values.size() + 1) / 2);
  for (std::size_t i = 0; i + 1 < values.size(); i += 2) {
    packed[i / 2] = static_cast<std::uint8_t>(values[i] | (values[i + 1] << 4));
  }
  if (values.size() % 2 != 0) {
    packed.back() = values.back();
  }
  out.Raw(packed);
}

std::vector<std::uint8_t> ReadNibbles(ByteReader& in, std::size_t count) {
  const ByteSpan packed = in.Raw((count + 1) / 2);
  if (!in.ok()) {
    return {};
  }
  std::vector<std::uint8_t> values(2 * packed.size());
  for (std::size_t i = 0; i < packed.size(); ++i) {
    values[2 * i] = packed[i] & 15;
    values[2 * i + 1] = packed[i] >> 4;
  }
  if (count % 2 != 0 && values.back() != 0) {
    in.Fail();
  }
  values.resize(count);
  return values;
}

void WriteBits(std::span<const std::uint8_t> values, ByteWriter& out) {
  Bytes packed((values.size() + 7) / 8);
  for (std::size_t i = 0; i < values.size(); ++i) {
    packed[i / 8] = static_cast<std::uint8_t>(packed[i / 8] | (values[i] << (i % 8)));
  }
  out.Raw(packed);
}

std::vector<std::uint8_t> ReadBits(ByteReader& in, std::size_t count) {
  const ByteSpan packed = in.Raw((count + 7) / 8);
  if (!in.ok()) {
    return {};
  }
  std::vector<std::uint8_t> values(count);
  for (std::size_t i = 0; i < count; ++i) {
    values[i] = (packed[i / 8] >> (i % 8)) & 1;
  }
  if (count % 8 != 0 && (packed.back() >> (count % 8)) != 0) {
    in.Fail();
  }
  return values;
}

void WriteNibblePlanes(std::span<const std::uint64_t> words, int nibbles, ByteWriter& out) {
  Bytes packed((words.size() + 1) / 2);
  for (int k = 0; k < nibbles; ++k) {
    for (std::size_t i = 0; i + 1 < words.size(); i += 2) {
      const std::uint64_t low = (words[i] >> (4 * k)) & 15;
      const std::uint64_t high = (words[i + 1] >> (4 * k)) & 15;
      packed[i / 2] = static_cast<std::uint8_t>(low | (high << 4));
    }
    if (words.size() % 2 != 0) {
      packed.back() = static_cast<std::uint8_t>((words.back() >> (4 * k)) & 15);
    }
    out.Raw(packed);
  }
}

void ReadNibblePlanes(ByteReader& in, int nibbles, std::span<std::uint64_t> words) {
  for (int k = 0; k < nibbles; ++k) {
    const ByteSpan packed = in.Raw((words.size() + 1) / 2);
    if (!in.ok()) {
      return;
    }
    for (std::size_t i = 0; i + 1 < words.size(); i += 2) {
      words[i] |= std::uint64_t{packed[i / 2] & 15u} << (4 * k);
      words[i + 1] |= (std::uint64_t{packed[i / 2]} >> 4u) << (4 * k);
    }
    if (words.size() % 2 != 0) {
      words.back() |= std::uint64_t{packed.back() & 15u} << (4 * k);
      if ((packed.back() >> 4) != 0) {
        in.Fail();
      }
    }
  }
}

}  // namespace atlas
