// SPDX-License-Identifier: BSD-3-Clause
// A record through the filter, on a desk: samples as doubles from stdin, and to stdout, as doubles, after every k-th of
// them (k is the first word): bias, its variance, and all states, as they are predicted for the next sample. The second
// word is the gate, 0 by default.
#include <cstdio>
#include <cstdlib>

#include <model.hpp>  // of the folder that the compiler is told: -I

namespace {

sensor::BiasFilter filter;

bool write(double value) { return std::fwrite(&value, sizeof value, 1, stdout) == 1; }

}  // namespace

int main(int count, char** words) {
    const long every = count > 1 ? std::strtol(words[1], nullptr, 10) : 1;
    if (every < 1) return 2;
    sensor::begin(filter, count > 2 ? sensor::Scalar(std::atof(words[2])) : sensor::Scalar(0));
    double y = 0;
    for (long k = 1; std::fread(&y, sizeof y, 1, stdin) == 1; ++k) {
        sensor::on_sample(filter, sensor::Scalar(y));
        if (k % every != 0) continue;
        bool is_written = write(double(sensor::bias(filter))) && write(double(sensor::bias_variance(filter)));
        for (const auto state : filter.state) is_written = is_written && write(double(state));
        if (!is_written) return 1;
    }
    return 0;
}
