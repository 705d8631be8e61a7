// Means of a pixel's samples. They are sums of differences to the first sample: equal samples keep
// their bits. Differences to the pixel's own color would leave a rounding of 1e3 in a pixel of 1e10
// that no sample sees.
struct Mean {
    vec4 first;
    vec4 sum;
    float weight;
};

Mean no_mean() {
    return Mean(vec4(0.0), vec4(0.0), 0.0);
}

void add(precise inout Mean mean, vec4 value, float weight) {
    if (mean.weight == 0.0) mean.first = value;
    mean.sum += weight * (value - mean.first);
    mean.weight += weight;
}

// `own` without samples.
vec4 value_of(Mean mean, vec4 own) {
    precise const vec4 value = mean.first + mean.sum / max(mean.weight, 1e-6);
    return mean.weight > 0.0 ? value : own;
}

// From a pixel's own value to the mean.
vec4 faded_in(vec4 own, vec4 mean, float onset) {
    precise const vec4 partly = own + onset * (mean - own);
    return onset < 1.0 ? partly : mean;
}
