/* numerics/chebyshev.py: series on [-1, 1], their coefficients listed from the highest order down. */

/* The series that has these values at the nodes. */
static void interpolate(const double values[], double series[])
{
    for (int j = 0; j < ORDER; j++) {
        double sum = 0.0;
        for (int i = 0; i < ORDER; i++) sum += TRANSFORM[j][i] * values[i];
        series[j] = sum;
    }
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
