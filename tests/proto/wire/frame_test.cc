// The framing state machine: golden bytes, pieces of any size, and bytes that are no frames.
#include "proto/wire/frame.h"

#include <algorithm>
#include <random>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

namespace atlas {
namespace {

Bytes FromText(std::string_view text) {
  return {text.begin(), text.end()};
}

Bytes Frame(ByteSpan payload) {
  Bytes frame = EncodeFrameHeader(payload);
  frame.insert(frame.end(), payload.begin(), payload.end());
  return frame;
}

std::string Hex(ByteSpan bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : bytes) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 0xF];
  }
  return text;
}

// Published in docs/protocol.md: request 1, Hello of version 1.0 by "demo".
TEST(FrameTest, GoldenHelloFrame) {
  const Bytes payload = {0x08, 0x01, 0x12, 0x08, 0x08, 0x01, 0x1a, 0x04, 'd', 'e', 'm', 'o'};
  EXPECT_EQ(Hex(Frame(payload)), "524146310c00000097bd8bf10801120808011a0464656d6f");
}

TEST(FrameTest, GoldenEmptyPayload) {
  // XXH64 of nothing, seed 0, is ef46db3751d8e999.
  EXPECT_EQ(Hex(EncodeFrameHeader({})), "524146310000000099e9d851");
}

TEST(FrameTest, ALargeOneIsTakenByItself) {
  const Bytes small(10, 1);
  const Bytes large(1'000, 2);
  Bytes stream;
  for (const Bytes& payload : {small, large, large, small}) {
    const Bytes frame = Frame(payload);
    stream.insert(stream.end(), frame.begin(), frame.end());
  }
  for (const std::size_t piece : {1u, 500u, 1'035u, 5'000u}) {
    FrameDecoder decoder;
    std::vector<Bytes> payloads;
    for (std::size_t at = 0; at < stream.size(); at += piece) {
      decoder.Push(ByteSpan(stream).subspan(at, std::min(piece, stream.size() - at)));
      while (true) {
        if (const auto frame = decoder.TakeLarge(10)) {
          EXPECT_EQ(frame->size(), large.size() + kFrameHeaderBytes);
          const ByteSpan payload = frame->Payload().value();
          payloads.emplace_back(payload.begin(), payload.end());
          continue;
        }
        const auto next = decoder.Next();
        ASSERT_TRUE(next.has_value()) << next.error().message();
        if (!*next) {
          break;
        }
        payloads.emplace_back((*next)->begin(), (*next)->end());
      }
    }
    EXPECT_EQ(payloads, (std::vector<Bytes>{small, large, large, small})) << piece;
    EXPECT_EQ(decoder.pending_bytes(), 0u);
  }
}

TEST(FrameTest, ALargeOneIsNotCheckedBeforeItIsLookedInto) {
  Bytes frame = Frame(Bytes(1'000, 2));
  frame.back() ^= 1;
  FrameDecoder decoder;
  decoder.Push(frame);
  const auto large = decoder.TakeLarge(999);
  ASSERT_TRUE(large.has_value());
  EXPECT_EQ(large->Payload().error().code(), StatusCode::kInvalidData);
}

TEST(FrameTest, ALargeOneMayStayForNext) {
  const Bytes payload(1'000, 2);
  FrameDecoder decoder;
  decoder.Push(Frame(payload));
  Bytes asked;
  const auto stays = [&](ByteSpan its) {
    asked.assign(its.begin(), its.end());
    return true;
  };
  EXPECT_FALSE(decoder.TakeLarge(10, stays).has_value());
  EXPECT_EQ(asked, payload);
  const auto next = decoder.Next();
  ASSERT_TRUE(next && *next);
  EXPECT_EQ(Bytes((*next)->begin(), (*next)->end()), payload);
}

TEST(FrameTest, WhatIsNoFrameIsNotTaken) {
  Bytes frame = Frame(Bytes(1'000, 2));
  for (const bool is_spoiled : {false, true}) {
    FrameDecoder decoder(is_spoiled ? 2'000 : 999);
    frame[0] = is_spoiled ? 'X' : 'R';
    decoder.Push(frame);
    EXPECT_FALSE(decoder.TakeLarge(10).has_value());
    EXPECT_FALSE(decoder.Next().has_value()) << "of another protocol, or too large";
  }
}

TEST(FrameTest, DecodesByteByByte) {
  Bytes stream;
  for (const std::string_view text : {"first", "", "third one"}) {
    const Bytes frame = Frame(FromText(text));
    stream.insert(stream.end(), frame.begin(), frame.end());
  }
  FrameDecoder decoder;
  std::vector<Bytes> payloads;
  for (const std::uint8_t byte : stream) {
    decoder.Push(ByteSpan(&byte, 1));
    auto next = decoder.Next();
    ASSERT_TRUE(next.has_value()) << next.error().message();
    if (*next) {
      payloads.emplace_back((*next)->begin(), (*next)->end());
    }
  }
  EXPECT_EQ(payloads, (std::vector<Bytes>{FromText("first"), {}, FromText("third one")}));
}

TEST(FrameTest, DecodesAnyPieces) {
  std::mt19937 random(7);
  std::vector<Bytes> sent;
  Bytes stream;
  for (int i = 0; i < 200; ++i) {
    Bytes payload(random() % 3000);
    for (std::uint8_t& byte : payload) {
      byte = static_cast<std::uint8_t>(random());
    }
    const Bytes frame = Frame(payload);
    stream.insert(stream.end(), frame.begin(), frame.end());
    sent.push_back(std::move(payload));
  }
  FrameDecoder decoder;
  std::vector<Bytes> received;
  for (std::size_t at = 0; at < stream.size();) {
    const std::size_t size = std::min<std::size_t>(random() % 9000, stream.size() - at);
    decoder.Push(ByteSpan(stream).subspan(at, size));
    at += size;
    for (auto next = decoder.Next(); next.value().has_value(); next = decoder.Next()) {
      received.emplace_back((*next)->begin(), (*next)->end());
    }
  }
  EXPECT_EQ(received, sent);
}

TEST(FrameTest, RefusesGarbageAtItsFirstWrongByte) {
  FrameDecoder decoder;
  decoder.Push(FromText("GET"));  // fewer bytes than a header
  const auto next = decoder.Next();
  ASSERT_FALSE(next.has_value());
  EXPECT_EQ(next.error().code(), StatusCode::kInvalidData);
}

TEST(FrameTest, AnErrorIsFinal) {
  FrameDecoder decoder;
  decoder.Push(FromText("nonsense"));
  ASSERT_FALSE(decoder.Next().has_value());
  decoder.Push(Frame(FromText("fine")));
  EXPECT_FALSE(decoder.Next().has_value());
}

TEST(FrameTest, RefusesALengthAboveTheLimit) {
  Bytes header = EncodeFrameHeader({});
  header[4] = 101;
  FrameDecoder decoder(100);
  decoder.Push(header);
  const auto next = decoder.Next();
  ASSERT_FALSE(next.has_value());
  EXPECT_EQ(next.error().code(), StatusCode::kInvalidData);
  header[4] = 100;
  EXPECT_TRUE(DecodeFrameHeader(header, 100).has_value());
}

TEST(FrameTest, DetectsEveryFlippedBit) {
  const Bytes payload = FromText("a payload of some bytes");
  const Bytes frame = Frame(payload);
  for (std::size_t bit = 0; bit < frame.size() * 8; ++bit) {
    Bytes damaged = frame;
    damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1u << (bit % 8)));
    FrameDecoder decoder;
    decoder.Push(damaged);
    const auto next = decoder.Next();
    // A flipped length either breaks the checksum or waits for bytes that never come.
    EXPECT_TRUE(!next.has_value() || !next->has_value()) << "bit " << bit;
  }
}

}  // namespace
}  // namespace atlas
