"""The numbers of EEG: filters, ocular correction, channels, epochs, wavelets, statistics, and the synthetic recording."""
