/* The same in C, on grey images, for a run script that turns PNG into PGM: LEFT.pgm RIGHT.pgm NDISP OUT.pfm */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static int width, height;

static unsigned char *grey(const char *path)
{
    FILE *file = fopen(path, "rb");
    if (!file || fscanf(file, "P5 %d %d 255", &width, &height) != 2 || fgetc(file) == EOF) exit(2);
    unsigned char *pixels = malloc((size_t)width * height);
    if (fread(pixels, width, height, file) != (size_t)height) exit(2);
    fclose(file);
    return pixels;
}

int main(int argc, char **argv)
{
    if (argc != 5) return 2;
    unsigned char *left = grey(argv[1]), *right = grey(argv[2]);
    int levels = atoi(argv[3]), radius = 3;
    FILE *file = fopen(argv[4], "wb");
    if (!file) return 2;
    fprintf(file, "Pf\n%d %d\n-1\n", width, height);
    for (int y = height - 1; y >= 0; y--)
        for (int x = 0; x < width; x++) {
            float found = INFINITY;
            double best = INFINITY;
            for (int d = 0; d < levels && d <= x; d++) {
                int taps = 0;
                double sum = 0;
                for (int v = y - radius; v <= y + radius; v++)
                    for (int u = x - radius; u <= x + radius; u++)
                        if (v >= 0 && v < height && u >= d && u < width) {
                            sum += abs(left[v * width + u] - right[v * width + u - d]);
                            taps++;
                        }
                if (sum / taps < best) {
                    best = sum / taps;
                    found = d;
                }
            }
            fwrite(&found, 4, 1, file);
        }
    return fclose(file) != 0;
}
