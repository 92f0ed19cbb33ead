/* numerics/chebyshev.py: series on [-1, 1], their coefficients listed from the highest order down. */

static double dot(const double a[], const double b[])
{
    double sum = a[0] * b[0];
    for (int n = 1; n < ORDER; n++) sum += a[n] * b[n];
    return sum;
}

/* The series that has these values at the nodes. */
static void interpolate(const double values[], double series[])
{
    for (int j = 0; j < ORDER; j++) series[j] = dot(TRANSFORM[j], values);
}

/* The sum of a series at z, by Clenshaw's recurrence. */
static double evaluate(const double series[], int order, double z)
{
    double twice = 2.0 * z, a = 0.0, b = 0.0;
    for (int n = 0; n < order; n++) {
        double next = series[n] + twice * a - b;
        b = a;
        a = next;
    }
    return a - z * b;
}

/* constant + scale times the integral from -1 on, of a series of this order; of one more. */
static void integrate(const double series[], int order, double constant, double scale,
                      double integral[])
{
    double sum = 0.0;
    for (int i = 0; i < order; i++) {
        double before = i < 2 ? 0.0 : series[i - 2];
        integral[i] = i < order - 1 ? scale * (series[i] - before) / (2.0 * (order - i))
                                    : scale * (series[i] - 0.5 * before);
        sum += (order - i) % 2 ? -integral[i] : integral[i];
    }
    integral[order] = constant - sum;
}

/* The derivative with respect to z: of one order less. */
static void differentiate(const double series[], double slopes[])
{
    for (int i = 0; i < ORDER - 1; i++)
        slopes[i] = (i < 2 ? 0.0 : slopes[i - 2]) + 2.0 * (ORDER - 1 - i) * series[i];
    slopes[ORDER - 2] *= 0.5;
}
