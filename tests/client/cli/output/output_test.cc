#include <limits>
#include <sstream>

#include <boost/json/parse.hpp>
#include <gtest/gtest.h>

#include "client/cli/output/json_text.h"
#include "client/cli/output/layer_json.h"
#include "client/cli/output/progress_bar.h"
#include "client/cli/output/text_table.h"

namespace atlas {
namespace {

TEST(JsonTextTest, NumbersAreWrittenAsPeopleDo) {
  const boost::json::object object = {{"z", 5.49},
                                      {"n", -0.0},
                                      {"i", 3},
                                      {"big", 1e300},
                                      {"nan", std::nan("")},
                                      {"s", "a\"b"},
                                      {"list", {1.5, nullptr, true}}};
  EXPECT_EQ(JsonText(object),
            R"({"z":5.49,"n":0,"i":3,"big":1e+300,"nan":null,"s":"a\"b","list":[1.5,null,true]})");
}

TEST(JsonTextTest, ReadsBackToTheSameDouble) {
  for (const double value : {0.1, 1.0 / 3.0, 1e-7, 123456789.123, -2.5e17}) {
    EXPECT_EQ(boost::json::parse(JsonText(value)).to_number<double>(), value);
  }
}

TEST(LayerJsonTest, HasTheContractsKeysAndUnits) {
  TileLayer layer;
  layer.altitude_mm = 5490;
  layer.sigma_100um = 315;
  layer.occupancy = 64;
  layer.flags = TileLayer::kTraversable;
  layer.observations = 17;
  layer.confirmed_s = 1'700'000'000;
  layer.column = 0x0F80;  // lowest first: no data, 8, 15, no data
  MapProfile profile;
  profile.column_segments = 4;
  const auto parsed = boost::json::parse(JsonText(LayerJson(layer, profile)));
  EXPECT_EQ(parsed.at("z_m").to_number<double>(), 5.49);
  EXPECT_EQ(parsed.at("sigma_m").to_number<double>(), 0.0315);
  EXPECT_EQ(parsed.at("occupancy").to_number<double>(), 0.9);
  EXPECT_TRUE(parsed.at("traversable").as_bool());
  EXPECT_FALSE(parsed.at("measured").as_bool());
  EXPECT_EQ(parsed.at("observations").to_number<int>(), 17);
  EXPECT_EQ(parsed.at("confirmed").to_number<std::int64_t>(), 1'700'000'000);
  EXPECT_EQ(UtcText(layer.confirmed_s), "2023-11-14 22:13:20");
  const auto& column = parsed.at("column");
  EXPECT_EQ(column.at("base_m").to_number<double>(), 5.0);  // 5.49 + 0.3 lies in [5, 6)
  EXPECT_EQ(column.at("segment_m").to_number<double>(), 1.0);
  const auto& probabilities = column.at("probabilities").as_array();
  ASSERT_EQ(probabilities.size(), 4U);
  EXPECT_TRUE(probabilities[0].is_null());
  EXPECT_EQ(probabilities[1].to_number<double>(), 0.5);
  EXPECT_EQ(probabilities[2].to_number<double>(), 0.9);
  EXPECT_TRUE(probabilities[3].is_null());
}

TEST(LayerJsonTest, ColumnsBelowZeroStandOnTheirLattice) {
  TileLayer layer;
  layer.altitude_mm = -1400;
  const auto parsed = boost::json::parse(JsonText(LayerJson(layer, {})));
  EXPECT_EQ(parsed.at("column").at("base_m").to_number<double>(), -2.0);
}

TEST(TextTableTest, AlignsColumns) {
  TextTable table({"name", ">n"});
  table.Row({"a", "1"});
  table.Row({"long", "100"});
  std::ostringstream out;
  table.Print(out);
  EXPECT_EQ(out.str(), "name    n\na       1\nlong  100\n");
}

TEST(TextTableTest, BytesAreReadable) {
  EXPECT_EQ(BytesText(0), "0 B");
  EXPECT_EQ(BytesText(999), "999 B");
  EXPECT_EQ(BytesText(12'400'000), "12.4 MB");
  EXPECT_EQ(BytesText(123'456), "123 kB");
}

TEST(ProgressBarTest, DrawsOnTerminalsOnly) {
  std::ostringstream plain;
  ProgressBar(plain, false, "work", 10).Update(5);
  EXPECT_TRUE(plain.str().empty());
  std::ostringstream terminal;
  {
    ProgressBar bar(terminal, true, "work", 10);
    bar.Update(5);
    const auto size = terminal.str().size();
    bar.Update(5);
    EXPECT_EQ(terminal.str().size(), size);
  }
  EXPECT_NE(terminal.str().find("50 %"), std::string::npos);
  EXPECT_TRUE(terminal.str().ends_with("\r\033[K"));
}

}  // namespace
}  // namespace atlas
